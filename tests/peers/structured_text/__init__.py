"""A translator from a part of IEC 61131-3 Structured Text to C: so the reference PLC program runs everywhere.

No package registry has a compiler for the language. This one knows what that program uses and refuses the
rest. It is stricter than the standard: types must be equal, and a number that does not fit its type, or an
index that lies outside, ends the program. What the standard means by a construct it cannot prove: matiec
does, where it is.
"""

from tests.peers.structured_text.syntax import SyntaxFault, parse
from tests.peers.structured_text.to_c import translate

__all__ = ["SyntaxFault", "parse", "translate"]
