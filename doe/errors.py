"""The exceptions of this package."""


class StatisticsError(ValueError):
    """Input from which no statistic can be computed; the message names the argument, its value and what is allowed."""


class StudyFileError(ValueError):
    """An entry of a study file that is not allowed; the message is one line naming key, value and what is allowed."""


class MeasurementError(ValueError):
    """Measured data that cannot be read; the message is one line naming file, key, value and what is allowed."""


class AuditError(ValueError):
    """A published study that cannot be read; the message is one line naming file, key, value and what is allowed."""


class StudyStopped(RuntimeError):
    """A study that ended before its last stage because the results of its runs cannot be analysed.

    Not a ValueError: the input was valid.
    """

    def __init__(self, stage: str, reason: str, runs: int) -> None:
        super().__init__(
            f"stopped in the {stage} stage: {reason}; {runs} finished runs are in the store, --resume continues with "
            "them once the study is changed"
        )
        self.stage, self.reason, self.runs = stage, reason, runs
