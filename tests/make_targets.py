"""What the Makefile can make."""

from __future__ import annotations

import re

RULE = re.compile(r"^([^\s:=#][^:=\n]*):(?!=)([^\n]*)((?:\n\t[^\n]*)*)", re.MULTILINE)


def idle_targets(makefile: str) -> set[str]:
    """Targets that do nothing, which make calls success; names in .PHONY without a rule too."""
    makefile = makefile.replace("\\\n", " ")
    rules = {
        target: ({*needs.partition("##")[0].split()} - {"venv"}, bool(recipe))
        for targets, needs, recipe in RULE.findall(makefile)
        for target in targets.split()
    }
    phony, _ = rules.pop(".PHONY")

    def does_something(target: str) -> bool:
        # `venv` is what nearly all need, and no work of theirs.
        needs, has_recipe = rules.get(target, (set(), False))
        return has_recipe or any(does_something(need) for need in needs)

    return {target for target in phony | set(rules) if not does_something(target)}


def targets(makefile: str) -> set[str]:
    """Names after which make does something."""
    names = {name for found in RULE.findall(makefile) for name in found[0].split()}
    return names - idle_targets(makefile)
