"""Pictures of bodies in motion: a stage, the person beside the robot, captions."""

from .captions import captioned as captioned
from .duet import accompany as accompany
from .film import film as film
from .film import middle_pictures as middle_pictures
from .film import with_captions as with_captions
from .stage import Stage as Stage
