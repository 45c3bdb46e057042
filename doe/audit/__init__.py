"""Audit of a published calibration study: what its own tables say about its figures. See README.md here."""

from doe.audit.checks import audit_study
from doe.audit.finding import Audit, Figure, Finding, Remark, Status
from doe.audit.printed import Printed, printed, printed_or_none
from doe.audit.study import PublishedStudy

__all__ = [
    "Audit",
    "Figure",
    "Finding",
    "Printed",
    "PublishedStudy",
    "Remark",
    "Status",
    "audit_study",
    "printed",
    "printed_or_none",
]
