"""The upper body's computer and the lower body's, joined by datagrams ([Kulic2012], 4.2.1).

``python -m mplearn_envs.link both`` lets two processes on this machine perform a walk.
"""

from .datagram import Datagram as Datagram
from .datagram import DatagramError as DatagramError
from .datagram import decode as decode
from .datagram import encode as encode
from .lower_body import LowerBody as LowerBody
from .receiver import LinkCounts as LinkCounts
from .receiver import Receiver as Receiver
from .sender import Sender as Sender
from .upper_body import UpperBody as UpperBody
