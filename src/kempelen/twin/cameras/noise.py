"""Everything that is wrong with a real camera's frames, one number each.

Sources: axial noise, Fankhauser et al. 2015; the other ranges are those measured on Kinect v2 sensors and
chess sets (docs: the twin's cameras). Each number may be changed alone, while the camera runs.
"""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Millimetres = Annotated[float, Field(ge=0, le=50)]
Share = Annotated[float, Field(ge=0, le=1)]


class Noise(BaseModel):
    """Strengths of all that goes wrong; 0 or False switches a kind off.

    Attributes:
        axial: Times the spread of depth along the ray: 1.5 - 0.5 z + 0.3 z² + 0.1 z^1.5 θ²/(π/2 - θ)² mm
            with z in metres and θ the angle at which the ray meets the surface.
        lateral: Spread of where on the scene a depth pixel looks, mm.
        flying: Whether a depth pixel that sees two surfaces mixes their phasors, and so reports a depth
            between them where there is nothing.
        multipath: Greatest excess of depth beside the foot of a piece, mm, where light comes by detours.
        dark_offset: How much farther than it is a black surface seems, mm; grey ones in proportion.
        dark_spread: Whether spread grows with 1/sqrt(IR), the reflected infrared light.
        dropout: Share of depth pixels on glossy black that report nothing.
        offset: Of all depths, mm, either sign: warming up, calibration.
        wiggling: Times the periodic error of a time-of-flight camera: -15 to +7 mm over its range.
        disparity: Spread of a stereo camera's disparity, pixels.
        holes: Share of patches on which a stereo camera finds no match.
        shot: Spread of a colour value in mid-grey, grey levels; it goes with the square root of light.
        blur: Spread of the colour lens, pixels.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    axial: Annotated[float, Field(ge=0, le=10)] = 1.0
    lateral: Annotated[float, Field(ge=0, le=5)] = 1.6
    flying: bool = True
    multipath: Millimetres = 5.0
    dark_offset: Annotated[float, Field(ge=-50, le=50)] = 6.0
    dark_spread: bool = True
    dropout: Share = 0.15
    offset: Annotated[float, Field(ge=-50, le=50)] = 9.0
    wiggling: Annotated[float, Field(ge=0, le=5)] = 1.0
    disparity: Annotated[float, Field(ge=0, le=2)] = 0.08
    holes: Share = 0.01
    shot: Annotated[float, Field(ge=0, le=40)] = 2.5
    blur: Annotated[float, Field(ge=0, le=5)] = 0.6


NOMINAL = Noise()
"""The middle of each range that was measured; spreads as measured."""
OFF = Noise(
    axial=0.0, lateral=0.0, flying=False, multipath=0.0, dark_offset=0.0, dark_spread=False, dropout=0.0,
    offset=0.0, wiggling=0.0, disparity=0.0, holes=0.0, shot=0.0, blur=0.0,
)  # fmt: skip
"""An ideal camera."""
