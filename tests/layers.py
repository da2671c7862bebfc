"""Holds the sources to the order of the folders (docs/architecture.md): a folder of src/ includes headers of the folders
before it, of itself, and of include/keller, and nothing else of ours. Speaks TAP.

usage: layers.py [ROOT]"""
import pathlib
import re
import sys
import tempfile

ORDER = ["base", "geom", "mesh", "geo", "accel", "wave", "path", "io", "cli"]
# C++ and the C++ libraries stay behind a C interface.
SHIMS = {"mesh": "OpenMesh", "geo": "GeographicLib"}
C, CPP, HEADER = {".c"}, {".cpp", ".cc", ".cxx"}, {".h", ".hh", ".hpp"}
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
INCLUDE = re.compile(r"^[ \t]*#[ \t]*include\b[ \t]*(.*?)[ \t]*$", re.MULTILINE)


def includes(path):
    """(line, what stands between the quotes or brackets, whether quoted) for each #include of a file."""
    text = COMMENT.sub(lambda comment: "\n" * comment.group().count("\n"), path.read_text(encoding="utf-8"))
    for match in INCLUDE.finditer(text):
        line = text.count("\n", 0, match.start()) + 1
        name = re.match(r'["<]([^">]+)[">]', match.group(1))
        yield line, name.group(1) if name else None, match.group(1).startswith('"')


def wrong_include(root, folder, name, quoted):
    """Why a file of `folder` (None: include/keller) may not include this, or None."""
    if name is None:
        return "a computed include cannot be checked"
    first, _, rest = name.partition("/")
    if first == "keller":
        if not quoted or not (root / "include" / name).is_file():
            return f'no such public header; expected "keller/NAME.h" in quotes, with NAME.h in include/keller ({name})'
    elif first in ORDER and (quoted or (root / "src" / name).is_file()):
        if folder is None:
            return f"a public header includes a private one ({name})"
        if ORDER.index(first) > ORDER.index(folder):
            return f"{folder} stands before {first} and may not use it ({name})"
        if not quoted or not rest:
            return f'expected "{first}/NAME.h" in quotes ({name})'
    elif quoted:
        return f'expected "FOLDER/NAME.h" or "keller/NAME.h" for a header of ours, <...> for any other ({name})'
    elif first in SHIMS.values() and (folder is None or SHIMS.get(folder) != first):
        return f"{first} is used only by its shim ({name})"
    return None


def wrong_files(root, folder):
    """One line for each breach in src/FOLDER, or in include/keller where folder is None."""
    where = root / "src" / folder if folder else root / "include" / "keller"
    for path in sorted(path for path in where.rglob("*") if path.suffix in C | CPP | HEADER):
        if path.suffix in CPP and folder not in SHIMS:
            yield f"{path.relative_to(root)}: C++ outside the shims"
        for line, name, quoted in includes(path):
            reason = wrong_include(root, folder, name, quoted)
            if reason:
                yield f"{path.relative_to(root)}:{line}: {reason}"


def wrong_places(root):
    """Folders of src/ that the order does not know, and sources that lie in none."""
    for path in sorted((root / "src").iterdir()):
        if path.is_dir() and path.name not in ORDER + ["__pycache__"]:
            yield f"src/{path.name}: not in the order {', '.join(ORDER)}"
        elif path.suffix in C | CPP | HEADER:
            yield f"src/{path.name}: lies in no folder"


def check_itself():
    """A small tree with every breach once: what is found must be exactly these lines."""
    files = {
        "include/keller/a.h": '#include <math.h>\n#include "base/b.h"\n',          # private header in a public one
        "src/base/b.h": '#include "keller/a.h"\n',
        "src/base/b.c": '#include "base/b.h"\n/* no\n#include "io/i.h"\n*/\n#include "geom/g.h"\n',  # upwards
        "src/geom/g.h": '#include <keller/a.h>\n',                                   # brackets
        "src/geom/g.c": '#include "g.h"\n#include "../base/b.h"\n#include <base/b.h>\n#include WHAT\n',
        "src/mesh/m.cpp": '#include <OpenMesh/Core/IO/MeshIO.hh>\n#include "base/b.h"\n',
        "src/io/i.h": '#include "path/p.h"\n#include "keller/none.h"\n',            # no such public header
        "src/io/i.cpp": "#include <OpenMesh/Core/IO/MeshIO.hh>\n",                   # C++, and another's library
        "src/path/p.h": '#include "accel/x.h"\n#include <cli/args.h>\n',             # <cli/args.h> is not ours: no file
        "src/extra/e.c": "",
        "src/loose.c": "",
    }
    expected = ["include/keller/a.h:2", "src/base/b.c:5", "src/geom/g.h:1", "src/geom/g.c:1", "src/geom/g.c:2",
                "src/geom/g.c:3", "src/geom/g.c:4", "src/io/i.cpp", "src/io/i.cpp:1", "src/io/i.h:2", "src/extra",
                "src/loose.c"]
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in files.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text)
        found = [line.partition(": ")[0] for lines in all_cases(root).values() for line in lines]
    missed = [f"not found: {line}" for line in expected if line not in found]
    return missed + [f"found, but not wrong: {line}" for line in found if line not in expected]


def all_cases(root):
    cases = {"every source lies in a folder of the order": list(wrong_places(root))}
    for folder in [None] + ORDER:
        cases[f"includes of {'src/' + folder if folder else 'include/keller'}"] = list(wrong_files(root, folder))
    return cases


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else __file__).resolve()
    root = root if root.is_dir() else root.parents[1]
    cases = {"finds every breach in a made-up tree": check_itself(), **all_cases(root)}
    print(f"1..{len(cases)}")
    for number, (name, wrong) in enumerate(cases.items(), 1):
        print(f"{'not ok' if wrong else 'ok'} {number} - {name}")
        for line in wrong:
            print(f"# {line}")
    return 1 if any(cases.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
