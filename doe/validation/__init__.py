"""Made-up laboratories: data with a truth that the diagnosis cannot read, and how often it finds it.

    model/             the declared model, its material and its conditions
    schedule.py        which truths are asked for, by the number of the data set
    truth.py           parameters and amplitudes of a truth, and what a strength is
    outside.py         effects that no library holds
    work_place.py      pours and verdicts in worker processes, and the clock
    laboratory.py      readings → a folder of measured data
    answers.py         truths → folders → verdicts → rows
    sets.py rates.py   rows in sets.csv, what an answer is worth, rates and targets
    campaign.py        all of it, for ``explorer validate-diagnosis``

The diagnosis is given the folder and the emulator's runs, and nothing else: no truth, no label, no number.
"""
