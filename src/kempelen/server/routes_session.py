"""Ways in: one-time links and passwords become sessions; links are made by operators."""

from typing import Annotated, Literal

from fastapi import APIRouter, HTTPException, Request, Response
from pydantic import Field

from kempelen.core.words import say
from kempelen.server.house import COOKIE, House, HouseDep, OperatorDep, address
from kempelen.server.model import Model
from kempelen.server.problems import Problem
from kempelen.server.routes import Me, qr_code
from kempelen.server.sessions import SESSION_LASTS_S, TOKEN_LASTS_S

router = APIRouter(prefix="/api", tags=["session"], responses={"4XX": {"model": Problem}})

_Secret = Annotated[str, Field(max_length=200)]


class Entry(Model):
    """A one-time token or a password."""

    token: _Secret = ""
    password: _Secret = ""


class LinkWish(Model):
    """For whom a link is to be."""

    role: Literal["operator", "player"]


class Link(Model):
    """A link that lets one browser in, once.

    Attributes:
        qr: The same for phones, an SVG picture.
        lasts: Until it is of no use any more, s.
    """

    url: str
    qr: str
    lasts: float


@router.post("/session")
async def enter(entry: Entry, request: Request, response: Response, house: HouseDep) -> Me:
    """Become more than a spectator; the session comes as a cookie."""
    if not house.entries.take(address(request)):
        house.tally.refused("entries", address(request))
        raise HTTPException(429, say("too_many_tries", "Too many tries. Wait a little, then try again."))
    session = house.sessions.redeem(entry.token) if entry.token else house.sessions.enter(entry.password)
    if session is None:
        house.tally.refused("entry", address(request))
        what = (
            say("link_used", "This link was used before, or is too old.")
            if entry.token
            else say("wrong_password", "This password is wrong.")
        )
        raise HTTPException(401, what)
    set_cookie(response, session, house)
    role = house.sessions.visitor(session, "").role
    return Me(role=role, password=house.sessions.has_password)


@router.delete("/session", status_code=204)
async def leave(request: Request, response: Response, house: HouseDep) -> None:
    """Be a spectator again."""
    house.sessions.close(request.cookies.get(COOKIE, ""))
    response.delete_cookie(COOKIE, path="/", secure=house.settings.secure, httponly=True, samesite="strict")


@router.post("/links")
async def link(wish: LinkWish, house: HouseDep, _: OperatorDep) -> Link:
    """A link for another browser."""
    url = url_with_token(house, wish.role)
    return Link(url=url, qr=qr_code(url), lasts=TOKEN_LASTS_S)


def url_with_token(house: House, role: Literal["operator", "player"], lasts: float = TOKEN_LASTS_S) -> str:
    """The page's address with a new one-time token."""
    return f"{house.settings.origin}/?token={house.sessions.token(role, lasts)}"


def set_cookie(response: Response, session: str, house: House) -> None:
    """Give a browser its session: no script can read it, no other site can use it."""
    response.set_cookie(
        COOKIE, session, max_age=int(SESSION_LASTS_S), path="/", secure=house.settings.secure,
        httponly=True, samesite="strict",
    )  # fmt: skip
