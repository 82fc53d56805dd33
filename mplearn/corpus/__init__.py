"""Corpora: many recordings, learned and recognised by many processes, whatever their number."""

from .cluster import RayTasks as RayTasks
from .dealing import Shard as Shard
from .dealing import deal as deal
from .executors import Executor as Executor
from .executors import Here as Here
from .executors import Processes as Processes
from .learning import Corpus as Corpus
from .learning import learn_corpus as learn_corpus
from .progress import Progress as Progress
from .reading import Reading as Reading
from .reading import probe as probe
from .recognising import RecognisedCorpus as RecognisedCorpus
from .recognising import recognise_corpus as recognise_corpus
from .shard import ShardReport as ShardReport
