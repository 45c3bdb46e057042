"""What a command makes is refused before any work where it cannot be made, in one line that names the option."""

import os

import pytest

from explorer.errors import CommandError
from explorer.files.output_file import check_new_file, check_vacant, write_whole

VACANT = "name a folder that is new or empty"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "mine.txt").write_text("kept")
    return tmp_path


def refused(*args, **named):
    check = check_vacant if "suffix" not in named else check_new_file
    with pytest.raises(CommandError) as found:
        check(*args, **named)
    return str(found.value)


def test_a_folder_that_is_new_or_empty_will_do(tmp_path):
    check_vacant(tmp_path / "new")
    check_vacant(tmp_path)


def test_a_folder_with_something_in_it_is_refused(folder):
    assert refused(folder) == f"--out {folder}: is not empty; {VACANT}"
    assert refused(folder, "--report") == f"--report {folder}: is not empty; {VACANT}"
    assert refused(folder, "") == f"{folder}: is not empty; {VACANT}"


def test_a_command_that_can_go_on_says_how_and_goes_on(folder):
    assert refused(folder, resume=False) == f"--out {folder}: is not empty; {VACANT}, or add --resume to go on there"
    check_vacant(folder, resume=True)


def test_files_of_the_command_itself_do_not_count(folder):
    check_vacant(folder, own=[folder / "mine.txt", folder / "other.txt"], resume=False)
    (folder / "theirs.txt").write_text("")
    assert "is not empty" in refused(folder, own=[folder / "mine.txt"], resume=False)


@pytest.mark.parametrize("resume", [None, False, True])
def test_a_file_is_no_folder(folder, resume):
    assert refused(folder / "mine.txt", resume=resume) == f"--out {folder / 'mine.txt'}: is a file; {VACANT}"


def test_a_file_has_to_be_new_in_a_folder_that_is_there(folder):
    check_new_file(folder / "new.csv", ".csv")
    check_new_file(folder / "new.csv")
    there, lost = folder / "mine.txt", folder / "none" / "a.txt"
    assert refused(there, suffix=".csv") == f"{there}: the name must end in .csv"
    assert refused(there, suffix="", option="--out") == f"--out {there}: exists already; choose another name"
    assert refused(lost, suffix=".txt") == f"{lost}: there is no folder {folder / 'none'}"


def test_a_file_that_cannot_be_put_in_place_leaves_no_part(folder):
    (folder / "taken").mkdir()
    before = sorted(folder.iterdir())
    with pytest.raises(OSError, match="taken"):
        write_whole(folder / "taken", "text")
    assert sorted(folder.iterdir()) == before


def test_a_link_stays_one_and_what_it_names_is_written(folder):
    (folder / "link.txt").symlink_to("mine.txt")
    write_whole(folder / "link.txt", "new")
    assert (folder / "link.txt").is_symlink()
    assert (folder / "mine.txt").read_text() == "new"


def test_a_pipe_is_written_and_left_in_its_place(folder):
    """As --summary /dev/stdout is, which a file would take the place of where root runs the command."""
    pipe = folder / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_whole(pipe, "told")
    assert os.read(reader, 100) == b"told"
    os.close(reader)
    assert pipe.is_fifo()
