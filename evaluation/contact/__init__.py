"""First contact of a static run: where the force leaves its rest level, beside the recorded stroke zero."""

from bufferstand.evaluation.contact.find import FirstContact, find_first_contact
from bufferstand.evaluation.contact.of_run import contact_warnings, first_contact_of
from bufferstand.evaluation.contact.rows import beside

__all__ = ["FirstContact", "beside", "contact_warnings", "find_first_contact", "first_contact_of"]
