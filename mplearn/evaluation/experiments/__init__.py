"""The experiments of the paper, each a function that returns a table or the outcomes for one."""

from .activities import activity_table as activity_table
from .anomaly import judge_paper_session as judge_paper_session
from .anomaly import judge_people as judge_people
from .boundaries import boundary_table as boundary_table
from .factorial import factorial_table as factorial_table
from .generation import generation_table as generation_table
from .inverse_kinematics import joint_error_table as joint_error_table
from .inverse_kinematics import marker_residual_table as marker_residual_table
from .judged import anomaly_table as anomaly_table
from .learning import Outcome as Outcome
from .learning import learn_session as learn_session
from .learning import learning_table as learning_table
from .peers import peers_table as peers_table
from .people import learn_together as learn_together
from .people import people_table as people_table
from .prediction import foretell_paper_sessions as foretell_paper_sessions
from .prediction import foretell_sessions as foretell_sessions
from .prediction import prediction_table as prediction_table
from .presentations import presentation_table as presentation_table
from .rejection import rejection_table as rejection_table
from .scaffolding import scaffolding_table as scaffolding_table
from .seen import Seen as Seen
from .sessions import by_person as by_person
from .sessions import learn_paper_sessions as learn_paper_sessions
from .sessions import learn_people as learn_people
from .sessions import observed_sessions as observed_sessions
