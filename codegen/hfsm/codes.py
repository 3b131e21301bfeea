"""The codes of all diagnostics of documents.

`docs/reference/document-errors.md` explains those from 500 on, `docs/explanation/model-checker.md` those
from 600 on.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Final


class Code(StrEnum):
    """The kind of a diagnostic: E is an error, W a warning, N a note."""

    UNREADABLE_FILE = "E500"
    FILE_TOO_LARGE = "E501"
    MALFORMED_XML = "E502"
    DOCUMENT_TYPE = "E503"
    NOT_A_DOCUMENT = "E504"
    MALFORMED_ELEMENT = "E506"
    REPEATED_ELEMENT = "E507"
    BAD_POLICY = "E510"
    NOT_ONE_ROOT = "E511"
    NOT_A_TREE = "E512"
    NO_STATE = "E513"
    MISSING_STATE = "E514"
    BAD_TRIGGER = "E515"
    BAD_PERIOD = "E516"
    REPEATED_ID = "E517"
    BAD_PRIORITY = "E518"
    BAD_HISTORY = "E519"
    BAD_CODE = "E520"
    RESERVED_NAME = "E521"
    FUNCTION_NAME_TAKEN = "E523"
    FOREIGN_LANGUAGE = "E525"
    BAD_PARAMETER = "E526"
    BAD_INPUT = "E527"
    BAD_OUTPUT = "E528"
    BAD_RESULT = "E529"
    BAD_INTERFACE_NAME = "E530"
    BAD_IDENTITY = "E531"
    UNKNOWN_INTERFACE = "E532"
    BAD_ARGUMENT = "E533"
    BAD_ROS_NAME = "E534"
    UNKNOWN_ROS_TYPE = "E535"
    BAD_ROS_INTERFACE = "E536"
    BAD_SURVIVAL = "E537"
    FILE_NOT_GENERATED = "E540"
    EXTENSION_WITHOUT_CLASS = "E541"
    SAME_COMPONENT = "E542"
    HIDDEN_INTERFACES = "E543"
    HIDDEN_LIBRARY = "E544"
    IMPORT_NOT_FOUND = "E550"
    IMPORT_OUTSIDE_DIRECTORY = "E551"
    RECURSIVE_IMPORT = "E552"
    CONFLICTING_IMPORTS = "E553"
    IMPORT_OF_WRONG_KIND = "E554"
    INVALID_SCXML = "E561"
    BAD_DESCRIPTION = "E605"
    VIOLATED_PROPERTY = "E610"
    BAD_PROPERTY = "E612"
    BAD_EXPRESSION = "E613"

    LOST_ON_SAVING = "W501"
    MISSING_ID = "W502"
    COMMA_IN_NUMBER = "W503"
    OLD_REPEATED_ELEMENT = "W504"
    SEVERAL_OUTERMOST_STATES = "W505"
    PYTHON2 = "W506"
    TRIGGER_WITHOUT_TYPE = "W507"
    OLD_REPEATED_ID = "W508"
    OLD_CODE_CHANGED = "W509"
    STATE_WITHOUT_NAME = "W510"
    REPEATED_STATE_NAME = "W511"
    MISSING_AUTOMATON = "W512"
    NOT_ONE_INITIAL_STATE = "W513"
    NEVER_ENTERED = "W514"
    NEVER_FIRES = "W516"
    FIRES_TOO_LATE = "W517"
    NEVER_FINISHES = "W518"
    CODE_IN_FINAL_STATE = "W519"
    UNDEFINED_NAME = "W520"
    UNREAD_VARIABLE = "W521"
    UNSET_VARIABLE = "W522"
    BLOCKING_CALL = "W523"
    UNKNOWN_ATTRIBUTE = "W524"
    DOUBTFUL_CODE = "W525"
    UNSENT_EVENT = "W526"
    UNUSED_EVENT = "W527"
    UNKNOWN_OPERATION = "W528"
    BAD_CALL = "W529"
    EQUAL_PRIORITIES = "W530"
    NO_TIME = "W531"
    NO_CONDITION = "W532"
    UNUSED_ROS_INTERFACE = "W533"
    DIFFERENT_ROS_TYPES = "W534"
    VARIABLE_ABOVE = "W535"
    UNSET_OUTPUT = "W536"
    RESULT_OF_OTHER_TYPE = "W537"
    OVERWRITTEN_RESULT = "W538"
    BAD_ANNOTATION = "W539"
    UNKNOWN_ELEMENT = "W541"
    ASSIGNED_VARIABLE_ABOVE = "W542"
    HIDDEN_ATTRIBUTE = "W543"
    OLD_LIBRARY = "W544"
    ENDLESS_CODE = "W545"
    SCXML_NOT_EXPORTED = "W560"
    SCXML_NOT_IMPORTED = "W561"
    SCXML_DIFFERENT_MEANING = "W562"
    CONFLICT = "W603"
    UNDECIDED_PROPERTY = "W611"

    KEPT_UNUSED = "N501"
    KEPT_LANGUAGE = "N502"
    PYTHON2_FIXED = "N503"
    OLD_NAME = "N504"
    NEVER_LEFT = "N515"
    SCXML_NO_EQUIVALENT = "N560"
    SCXML_OTHER_FORM = "N561"
    SCXML_FOREIGN = "N562"
    POSSIBLE_CONFLICT = "N603"
    UNCLEAR_CODE = "N606"
    UNDECIDED = "N607"
    NOT_SEEN = "N608"


LOST: Final = frozenset((Code.LOST_ON_SAVING, Code.SCXML_NOT_IMPORTED))
"""The kinds that say that something of a file is not in the document."""

UNREADY: Final = frozenset((Code.ENDLESS_CODE,))
"""The warnings that keep a document from being ready to drive a robot."""

FOLLOWED: Final = frozenset((Code.UNSENT_EVENT, Code.UNUSED_EVENT))
"""The kinds that are found by following what all code does."""

PROVED: Final = frozenset(
    (
        Code.BAD_DESCRIPTION,
        Code.BAD_EXPRESSION,
        Code.BAD_PROPERTY,
        Code.CONFLICT,
        Code.FIRES_TOO_LATE,
        Code.NEVER_ENTERED,
        Code.NEVER_FINISHES,
        Code.NEVER_FIRES,
        Code.NEVER_LEFT,
        Code.POSSIBLE_CONFLICT,
        Code.UNCLEAR_CODE,
        Code.UNDECIDED,
        Code.UNDECIDED_PROPERTY,
        Code.VIOLATED_PROPERTY,
    )
)
"""The kinds that the model checker finds."""
