"""Digital calibration certificates (DCC of PTB): what they say, and what a channel takes of them."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.certificates.certificate import (
        Certificate,
        CertificateTable,
        Values,
    )
    from bufferstand.drivers.certificates.channel_calibration import (
        ChannelCalibration,
        calibrated,
    )
    from bufferstand.drivers.certificates.reading import (
        read_certificate,
    )
    from bufferstand.drivers.certificates.stand_text import (
        changed_stand,
        channel_of,
        fragment,
    )

__all__ = [
    "Certificate",
    "CertificateTable",
    "ChannelCalibration",
    "Values",
    "calibrated",
    "changed_stand",
    "channel_of",
    "fragment",
    "read_certificate",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
