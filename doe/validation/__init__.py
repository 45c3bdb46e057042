"""Made-up laboratories: data with a truth that the diagnosis cannot read, and how often it finds it.

    laboratories/      files of laboratories: bodies, rig, conditions, what is handed out
    truth.py           which truths are asked for, and the parameters and amplitudes of each
    outside.py         effects that no library holds
    work_place.py      pours in worker processes, and the clock
    scanner.py         a made-up scanner
    laboratory.py      reads such a file; pours → a folder of measured data, with scans or without
    sets.py            rows in sets.jsonl, what an answer is worth, rates and targets
    reference.py       pours of every effect, many of each, that tell how strong it is
    limit.py           its strength in σ, and how often any method could name it
    cross_validation.py  the rule of the diagnosis on reference pours
    campaign.py        all of it, truths → folders → verdicts → rows, for ``explorer validate-diagnosis``

The diagnosis is given the folder and nothing else: no truth, no label, no number.
"""
