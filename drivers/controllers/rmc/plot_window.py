"""The plot's samples as the window of a ring controller's ring."""

from __future__ import annotations

from collections.abc import Sequence

from bufferstand.drivers.controllers.rmc.plot import PlotBlock, PlotUpload
from bufferstand.drivers.register_maps import Profile

_US, _WHOLE = 1_000_000, 1 << 32


class PlotWindow:
    """Gives the window of a ring that begins where it is asked for.

    Parameters
    ----------
    plot : PlotUpload
    profile : Profile
        Whose ring it is; its channels are the plot's data sets.
    channels : sequence of str
        In the order of the data sets.
    """

    def __init__(self, plot: PlotUpload, profile: Profile, channels: Sequence[str]) -> None:
        self._plot, self._profile, self._channels = plot, profile, tuple(channels)
        self.rate_Hz = 0.0
        """Of the plot [Hz]; known once the controller was identified."""
        self.is_uploading = False
        self._block: PlotBlock | None = None
        self._asked = 0

    def read(self, acknowledged: int) -> list[int]:
        """Get the registers of the window; what was asked for last is given once more.

        Raises
        ------
        DeviceFault
            As :meth:`PlotUpload.read`.
        """
        if not self.is_uploading:
            self._plot.begin()
            self.is_uploading = True
        if self._block is None or self._asked != acknowledged:  # else it is asked for once more
            self._block, self._asked = self._plot.read(), acknowledged
        block = self._block
        header = {
            "first_sequence": (self._plot.next if block is None else block.first) % _WHOLE,
            "count": 0 if block is None else len(block.rows),
            "overruns": self._plot.overruns,
            "status_word": 0,
        }
        ring = self._profile.ring
        words = self._profile.ring_header.encode({name: header[name] for name, _ in ring.header})
        if block is not None:
            words += self._sample_words(block)
        return words + [0] * (ring.registers - len(words))

    def _sample_words(self, block: PlotBlock) -> list[int]:
        period_us, words = _US / self.rate_Hz, []
        layout = self._profile.ring_sample
        for number, row in enumerate(block.rows.tolist()):
            sample = dict(zip(self._channels, row, strict=True))
            sample["tick"] = round((block.first + number) * period_us) % _WHOLE
            words += layout.encode(sample)
        return words
