"""``bufferstand report``: what a customer or an authority gets."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import click

from bufferstand.cli.evaluation import JudgingOptions, judging_options
from bufferstand.cli.options import EXISTING, FILE, out_option, warn
from bufferstand.cli.passwords import SIGN_PASSWORD, sign_password
from bufferstand.evaluation.wording import LANGUAGES, Code
from bufferstand.foundation import BadInput, how_to_add


@click.command("report", epilog="Example:  bufferstand report campaign --out campaign/report")
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=EXISTING)
@out_option("Folder for the report (HTML and PDF).", required=False)
@click.option(
    "--dtr",
    "digital",
    metavar="FILE.xml",
    type=FILE,
    help="Write the digital test report (XML, DCC 3.2.1 of PTB, D-SI units); alone where there is no --out.",
)
@click.option(
    "--fields",
    "fields_file",
    metavar="FILE.toml",
    type=FILE,
    help="What only the laboratory knows (default report.toml beside the runs).",
)
@click.option(
    "--evaluation",
    metavar="FILE.json",
    type=FILE,
    help="Report this evaluation instead of evaluating the runs anew.",
)
@click.option(
    "--before",
    metavar="FILE.json",
    type=FILE,
    help="An earlier evaluation of the same runs: say what moved, and whether beyond its uncertainty.",
)
@click.option(
    "--model", metavar="MODEL.toml", type=FILE, help="Show what this spring model says to the same strokes."
)
@click.option(
    "--annex",
    type=click.Choice(["short", "full"]),
    default="short",
    help="full: also the tables by cycle, every uncertainty budget, the numbers behind the figures.",
)
@click.option(
    "--table", metavar="FILE.xlsx", type=FILE, help="Write every table, by cycle, too, as a workbook."
)
@click.option(
    "--language",
    type=click.Choice(LANGUAGES),
    help="Language of the report (default: language in report.toml, else en).",
)
@click.option(
    "--sign",
    metavar="KEY.p12|pkcs11:…",
    help="Sign the PDF (PAdES) with this key: a PKCS#12 file, or a token's address (RFC 7512).",
)
@click.option(
    "--sign-password-file",
    metavar="FILE",
    type=FILE,
    help=f"Its first line is the key's password or PIN (default: {SIGN_PASSWORD}, else asked for).",
)
@judging_options
def command(
    *,
    paths: tuple[Path, ...],
    out: Path | None,
    digital: Path | None,
    fields_file: Path | None,
    evaluation: Path | None,
    before: Path | None,
    model: Path | None,
    annex: str,
    table: Path | None,
    language: Code | None,
    sign: str | None,
    sign_password_file: Path | None,
    judging: JudgingOptions,
) -> None:
    """Write the test report (HTML, PDF, XML) of a run or a campaign, or of several side by side.

    PATH is a run file or a campaign's folder; of two or more, the first is the reference that the others are
    compared with. What only the laboratory knows (address, customer, who authorises) is read from report.toml
    in the folder; a report is marked as a draft until all of it is there. What runs are judged by is as in
    evaluate.
    """
    from bufferstand.evaluation.archive import load_evaluation
    from bufferstand.evaluation.report import formats_here, write_comparison, write_report
    from bufferstand.evaluation.report.signing import open_key
    from bufferstand.evaluation.report.source import Given, read_fields

    if sign is None and sign_password_file is not None:
        raise BadInput(
            "a password of a key, and no key", file="--sign-password-file", remedy="add --sign KEY.p12"
        )
    if out is None and digital is None:
        raise BadInput(
            "nothing says where the report is to be written",
            file="--out",
            remedy="give --out DIR for HTML and PDF, or --dtr FILE.xml for the digital report",
        )
    formats = formats_here()
    if out is not None and "pdf" not in formats:
        warn(f"no PDF: typst is not installed; {how_to_add('pdf')} adds it")
    given = Given(
        options=judging.options,
        limit_set=judging.limit_set,
        fields=None if fields_file is None else read_fields(fields_file),
        model=model,
        conformity=judging.conformity,
        jobs=None,
        language=language,
        detailed=annex == "full",
        earlier=None if before is None else load_evaluation(before),
    )
    if len(paths) > 1:
        _check_compared(out, digital, evaluation)
    # The key is looked at before anything is evaluated: what is wrong with it is known at once.
    with nullcontext() if sign is None else open_key(sign, sign_password(sign_password_file)) as key:
        if len(paths) > 1 and out is not None:
            written = write_comparison(paths, out, formats=formats, given=given, table=table, key=key)
        else:
            written = write_report(
                paths[0],
                out,
                formats=formats,
                document=None if evaluation is None else load_evaluation(evaluation),
                given=given,
                table=table,
                digital=digital,
                key=key,
            )
    for file in written:
        click.echo(file)


def _check_compared(out: Path | None, digital: Path | None, evaluation: Path | None) -> None:
    """Refuse what is only for the report of one PATH."""
    if evaluation is not None:
        raise BadInput(
            "an evaluation is of the runs of one PATH", file="--evaluation", remedy="leave it out here"
        )
    if out is None or digital is not None:
        raise BadInput(
            "a digital report is of the runs of one PATH",
            file="--dtr",
            remedy="give one PATH, or --out DIR alone",
        )
