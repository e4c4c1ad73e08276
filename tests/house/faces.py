"""The contract of import-linter that a room is entered by its face: nobody outside passes it by."""

from __future__ import annotations

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output
from importlinter.application import contract_utils


class FaceContract(Contract):
    """Each module that is no package is imported only from inside the package in which it lies.

    What lies inside a package, its sub-packages included, may import the package's modules. Everything else
    imports the package, whose ``__init__`` lists in ``__all__`` what it offers.
    """

    type_name = "faces"

    root = fields.ModuleField()
    ignore_imports = fields.SetField(subfield=fields.ImportExpressionField(), required=False)

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:  # noqa: ARG002 - import-linter's signature
        """Return every import from outside that passes a face by."""
        root = self.root.name  # type: ignore[attr-defined]
        contract_utils.remove_ignored_imports_and_report(
            graph=graph,
            ignore_imports=self.ignore_imports,  # type: ignore[arg-type]
            unmatched_alerting=contract_utils.AlertLevel.ERROR,
        )
        packages = {module.rpartition(".")[0] for module in graph.modules}
        passed_by = [
            (importer, module)
            for module in sorted(graph.modules)
            if module.startswith(f"{root}.") and module not in packages
            for importer in sorted(graph.find_modules_that_directly_import(module))
            if not f"{importer}.".startswith(f"{module.rpartition('.')[0]}.")
        ]
        return ContractCheck(kept=not passed_by, metadata={"passed_by": passed_by})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print each such import, with the face to import from."""
        for importer, module in check.metadata["passed_by"]:
            output.print_error(f"{importer} imports {module}: import {module.rpartition('.')[0]} instead")
