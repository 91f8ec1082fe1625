"""The web server: HTTP and one WebSocket over a station (`kempelen.app.station`), and the built web page.

::

    topics.py    what pages show      commands.py  what may be asked for    messages.py  the WebSocket's
    hub.py       topics to clients    dispatch.py  commands to the station  bridge.py    station to topics
    socket.py    the WebSocket        routes*.py   HTTP                     page.py      the built page
    security.py  Host, Origin, sizes  sessions.py  who may do what          limits.py    how often
    house.py     all of it together   app.py       the ASGI application     run.py       the process

To add routes: make a ``router = APIRouter(prefix="/api/…", tags=[…])`` in ``routes_NAME.py``, with the
dependencies of `house`, and name the module in `app.ROUTES`::

    @router.get("/ports")
    def ports(station: StationDep, _: OperatorDep) -> PortsView: ...

Reads answer from what is known; whatever touches the robot is a command. A `KempelenError` that a route
raises becomes an answer with its message and hint (`problems`).

To show something new: a model and a field in `topics`, then ``hub.put("name", value)`` whenever it changed.
It is cheap to call often: equal values are dropped, and values of `hub.FLOWING` topics are sent at most
`hub.BEAT_S` apart. A value that only says what changed comes with the whole one:
``hub.put("scene", moved, whole=everything)``; a client that missed one gets the whole. What has to be
looked at again and again is a feed (`feeds`), which asks ``hub.followed("name")`` first.
"""
