"""Made-up laboratories: data with a truth that is hidden from the diagnosis, and how often the diagnosis finds it.

    laboratories/      laboratory files: bodies, rig, conditions, what is handed out
    truth.py           which truths are asked for, and the parameters and amplitudes of each
    outside.py         effects that are not in the library
    work_place.py      pours in worker processes, and the deadline
    scanner.py         a made-up scanner
    laboratory.py      reads a laboratory file; pours → a folder of measured data, with or without scans
    sets.py            rows in sets.jsonl, scores of the answers, rates and targets
    reference.py       many pours of every effect, which measure its strength
    limit.py           the strength of an effect in σ, and how often any method could name it
    cross_validation.py  the rule of the diagnosis, tested on reference pours
    campaign.py        the whole chain, truths → folders → verdicts → rows, for ``explorer validate-diagnosis``

The diagnosis is given the folder and nothing else: no truth, no label, no number.
"""
