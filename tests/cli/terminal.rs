//! What a terminal gets: text folded at its width and painted; and what is there for the shell: completions and manual pages. A
//! terminal of the wanted width is made by `script` of util-linux.

use super::{Folder, laboratory, paint, refused};
use crate::cli::assert_refused;
use crate::common::{Run, parse};
use anstream::adapter::strip_str;
use std::process::{Command, Stdio};

const ESCAPE: char = '\u{1b}';

/// Environment variables that decide about colours, none of which a test inherits.
const ABOUT_COLOUR: [&str; 5] = ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE", "COLORTERM", "CI"];

/// What a shell command prints in a terminal of this width, where `brdfit` is the program. `None`, with a visible line, where there
/// is no `script` to make a terminal.
#[allow(clippy::print_stderr)]
fn on_terminal(
    folder: &Folder,
    columns: usize,
    environment: &[(&str, &str)],
    command: &str,
) -> Option<String> {
    // A function, because `brdfit` stands anywhere in a command and the path of the program may hold blanks.
    let program = env!("CARGO_BIN_EXE_brdfit");
    let inside = format!("stty rows 24 cols {columns}; brdfit() {{ '{program}' \"$@\"; }}; {command}");
    let mut script = Command::new("script");
    script.args(["-qec", &inside, "/dev/null"]).current_dir(folder.path(".")).stdin(Stdio::null());
    ABOUT_COLOUR.iter().for_each(|name| {
        script.env_remove(name);
    });
    script.env("SHELL", "/bin/sh").env("TERM", "xterm").envs(environment.iter().copied());
    match script.output() {
        Ok(output) => Some(String::from_utf8(output.stdout).unwrap().replace("\r\n", "\n")),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            eprintln!("skipped: there is no program 'script', which makes a terminal");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// A run whose standard output is a pipe, under these variables.
fn in_a_pipe(folder: &Folder, environment: &[(&str, &str)], line: &str) -> Run {
    let mut command = Command::new(env!("CARGO_BIN_EXE_brdfit"));
    command.current_dir(folder.path(".")).args(crate::common::typed(line)).stdin(Stdio::null());
    ABOUT_COLOUR.iter().for_each(|name| {
        command.env_remove(name);
    });
    let output = command.env("TERM", "xterm").envs(environment.iter().copied()).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    Run { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
}

/// The words of a text without their digits, since times differ from run to run.
fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(|word| word.replace(|c: char| c.is_ascii_digit(), "")).collect()
}

/// These words in alphabetical order: the parts of a folded table stand in another.
fn sorted_words(text: &str) -> Vec<String> {
    let mut words = words(text);
    words.sort_unstable();
    words
}

/// Folding loses nothing, and leaves no line too wide unless it is a single word, such as a check sum.
#[test]
fn everything_fits_the_terminal() {
    let folder = laboratory();
    paint(&folder);
    let long = "theta_i,phi_i,theta_o,phi_o,a_channel_with_a_long_name,another_channel_with_a_name_as_long\n";
    folder.write("long.csv", format!("{long}10,0,20,180,0.1,0.2\n30,0,40,90,0.1,0.2\n50,0,10,0,0.1,0.2\n"));
    for command in [
        "fit a.csv -m openpbr --budget fast",
        "evaluate paint.csv -m 'openpbr(base=dielectric)'",
        "evaluate long.csv -m 'lambert + cook-torrance + cook-torrance'",
        "fit a.csv b.csv -m lambert -m 'lambert + cook-torrance'",
        "models openpbr",
        "models",
        "info a.csv",
        "info long.csv",
        "check paint.csv",
        "check paint.json",
        "tradeoff paint.csv -m lambert -m 'lambert + cook-torrance'",
        "--help",
        "fit --help",
        "synth --help",
    ] {
        let piped = in_a_pipe(&folder, &[("COLUMNS", "40")], command).stdout;
        for columns in [60, 80, 200] {
            let plain = [("NO_COLOR", "1")];
            let Some(shown) = on_terminal(&folder, columns, &plain, &format!("brdfit {command} 2>err.txt"))
            else {
                return;
            };
            assert_eq!(sorted_words(&shown), sorted_words(&piped), "{command}\n{shown}");
            // The parser does not wrap usages.
            let wraps = |line: &&str| !line.starts_with("Usage: ");
            for line in shown.lines().filter(wraps).filter(|line| line.chars().count() > columns) {
                assert_eq!(
                    line.split_whitespace().count(),
                    1,
                    "{columns} columns, {command}: {line}\n{shown}"
                );
            }
        }
    }
}

#[test]
fn messages_fit_the_terminal_too() {
    let folder = laboratory();
    let command = "brdfit fit a.csv -m lambert --metrik cbrt >out.txt";
    let Some(shown) = on_terminal(&folder, 60, &[], command) else { return };
    let piped = in_a_pipe(&folder, &[], "fit a.csv -m lambert --metrik cbrt").stderr;
    assert_eq!(piped.lines().count(), 1);
    assert!(shown.starts_with("\u{1b}[1m\u{1b}[31merror:\u{1b}[0m "), "{shown:?}");
    let shown = strip_str(&shown).to_string();
    assert!(shown.lines().count() > 1 && shown.lines().all(|line| line.chars().count() <= 60), "{shown}");
    assert_eq!(words(&shown), words(&piped));
}

/// JSON and CSV are for programs, on a terminal too.
#[test]
fn data_are_never_folded() {
    let folder = laboratory();
    for command in ["evaluate -m lambert --set kd=0.3 --at a.csv", "info a.csv --json"] {
        let Some(shown) = on_terminal(&folder, 30, &[], &format!("brdfit {command}")) else { return };
        assert_eq!(shown, in_a_pipe(&folder, &[], command).stdout);
    }
}

#[test]
fn colour_is_for_terminals_that_want_it() {
    let folder = laboratory();
    for command in ["evaluate a.csv -m lambert --set kd=0.3", "--help", "check a.csv", "info a.csv"] {
        let timeless = |text: &str| words(text);
        let piped = in_a_pipe(&folder, &[], command);
        assert!(!piped.stdout.contains(ESCAPE) && !piped.stderr.contains(ESCAPE), "{piped:?}");
        // Nothing but colour differs.
        let forced = in_a_pipe(&folder, &[("CLICOLOR_FORCE", "1")], command).stdout;
        assert!(forced.contains(ESCAPE), "{forced}");
        let stripped = strip_str(&forced).to_string();
        assert_eq!(timeless(&stripped), timeless(&piped.stdout));
        assert_eq!(stripped.lines().count(), piped.stdout.lines().count());

        let line = format!("brdfit {command}");
        let Some(shown) = on_terminal(&folder, 200, &[], &line) else { return };
        assert!(shown.contains(ESCAPE), "{shown}");
        assert_eq!(
            timeless(&strip_str(&shown).to_string()),
            timeless(&format!("{}{}", piped.stdout, piped.stderr))
        );
        for unwanted in [("NO_COLOR", "1"), ("CLICOLOR", "0"), ("TERM", "dumb")] {
            let shown = on_terminal(&folder, 200, &[unwanted], &line).unwrap();
            assert!(!shown.contains(ESCAPE), "{unwanted:?}: {shown}");
        }
    }
    // The verdict is green or red, and says so in words.
    let verdict = |command: &str| {
        let forced = in_a_pipe(&folder, &[("CLICOLOR_FORCE", "1")], command).stdout;
        forced.lines().last().unwrap().to_owned()
    };
    assert!(verdict("evaluate a.csv -m lambert --set kd=0.3").starts_with("\u{1b}[32musable: "));
    folder.write("few.csv", "theta_i,phi_i,theta_o,phi_o,r\n10,0,20,180,0.1\n");
    assert!(verdict("fit few.csv -m lambert").starts_with("\u{1b}[31mNOT USABLE: "));
}

#[test]
fn quiet_keeps_the_ranking_of_several_models() {
    let folder = laboratory();
    let models = "-m oren-nayar -m 'lambert + cook-torrance'";
    let run = folder.brdfit(&format!("fit a.csv {models} -q"));
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""));
    let lines: Vec<&str> = run.stdout.lines().collect();
    assert_eq!(lines.len(), 3, "{}", run.stdout);
    assert_eq!(lines[0], "ranking by unbiased-cbrt:");
    assert!(
        lines[1].contains("  lambert + cook-torrance(") && lines[2].contains("  oren-nayar("),
        "{lines:?}"
    );
    // The same as without -q, where it follows the tables.
    let all = folder.brdfit(&format!("fit a.csv {models}")).good().stdout;
    assert!(all.ends_with(&format!("\n\n{}", run.stdout)), "{all}");
    // Several inputs are each named; of a single model there is nothing to say.
    let run = folder.brdfit(&format!("fit a.csv b.csv {models} -q"));
    let names: Vec<&str> = run.stdout.lines().filter(|line| line.ends_with(".csv")).collect();
    assert_eq!(names, ["a.csv", "b.csv"]);
    assert!(!run.stdout.contains("summary"));
    assert_eq!(folder.brdfit("fit a.csv b.csv -m lambert -q").good().stdout, "");
    // JSON is alone, whatever else is asked for.
    parse(&folder.brdfit(&format!("fit a.csv {models} -q --json")).stdout);
}

#[test]
fn several_inputs_end_with_a_summary() {
    let folder = laboratory();
    folder.write("bad.csv", "theta_i,phi_i,theta_o,phi_o,r\n10,0,20,180,abc\n");
    let run =
        folder.brdfit("fit a.csv bad.csv clean.csv -m lambert -m 'lambert + cook-torrance' -o all.json");
    assert_eq!(run.code, Some(1));
    let all = parse(&folder.read("all.json"));
    let summary = run.stdout.split("\nsummary:\n").nth(1).expect("a summary");
    let lines: Vec<&str> = summary.lines().collect();
    assert_eq!(lines.len(), 4, "{summary}");
    let heading: Vec<&str> = lines[0].split_whitespace().collect();
    assert_eq!(heading, ["input", "unbiased-cbrt", "over", "noise", "warnings", "verdict", "best", "model"]);
    for (line, index) in lines[1..3].iter().zip([1, 3]) {
        let report = &all["reports"][index];
        let cells: Vec<&str> = line.split_whitespace().collect();
        assert_eq!(cells[0], report["data"]["path"]);
        let number = |value: &serde_json::Value, digits: usize| {
            value.as_f64().map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
        };
        assert_eq!(cells[1], number(&report["errors"]["unbiased_cbrt"], 6));
        assert_eq!(cells[2], number(&report["misfit"]["ratio"], 3));
        assert_eq!(cells[3], report["warnings"].as_array().unwrap().len().to_string());
        assert_eq!(cells[4], "usable");
        assert!(line.ends_with(report["model"].as_str().unwrap()), "{line}");
    }
    assert!(lines[3].starts_with("  failed: bad.csv:2: "), "{}", lines[3]);
    // With a single model there is no ranking.
    let run = folder.brdfit("fit a.csv b.csv -m lambert").good();
    assert!(!run.stdout.contains("ranking") && run.stdout.contains("\n\nsummary:\n"), "{}", run.stdout);
    // A single input needs no summary.
    assert!(!folder.brdfit("fit a.csv -m lambert -m oren-nayar").good().stdout.contains("summary"));
}

/// The rows of a CSV file, each field under its name.
fn records(text: &str) -> Vec<std::collections::BTreeMap<String, String>> {
    csv::Reader::from_reader(text.as_bytes()).deserialize().map(Result::unwrap).collect()
}

#[test]
fn the_summary_file_agrees_with_the_reports() {
    let folder = laboratory();
    folder.write("two,words.csv", folder.read("b.csv"));
    let models = "-m lambert -m 'lambert + cook-torrance'";
    folder.brdfit(&format!("fit a.csv two,words.csv {models} -q -o all.json --summary all.csv"));
    let (all, rows) = (parse(&folder.read("all.json")), records(&folder.read("all.csv")));
    let mut rows = rows.iter();
    let mut places = std::collections::BTreeMap::new();
    for rank in all["ranking"].as_array().unwrap() {
        let report = &all["reports"][usize::try_from(rank["index"].as_u64().unwrap()).unwrap()];
        let place = places.entry(report["data"]["path"].to_string()).or_insert(0);
        *place += 1;
        for parameter in report["parameters"].as_array().unwrap() {
            let row = rows.next().expect("a row per parameter");
            let text = |value: &serde_json::Value| value.as_str().unwrap_or_default().to_owned();
            let name = format!("{}.{}", text(&parameter["lobe"]), text(&parameter["name"]));
            for (column, expected) in [
                ("file", text(&report["data"]["path"])),
                ("model", text(&report["model"])),
                ("rank", place.to_string()),
                ("metric", text(&report["metric"])),
                ("usable", report["termination"]["usable"].to_string()),
                ("parameter", name),
                ("channel", text(&parameter["channel"])),
                ("unit", text(&parameter["unit"])),
                ("status", text(&parameter["status"])),
            ] {
                assert_eq!(row[column], expected, "{column}: {row:?}");
            }
            for (column, expected) in [
                ("error", &report["errors"]["unbiased_cbrt"]),
                ("value", &parameter["value"]),
                ("std_error", &parameter["std_error"]),
                ("ci95_low", &parameter["ci95"][0]),
                ("ci95_high", &parameter["ci95"][1]),
            ] {
                // To the last bit; an empty field is an unknown number.
                assert_eq!(row[column].parse().ok(), expected.as_f64(), "{column}: {row:?}");
            }
            assert_eq!(row.len(), 14);
        }
    }
    assert!(rows.next().is_none());

    // One input and one model have a summary too, the same.
    folder.brdfit("fit a.csv -m lambert -q --summary one.csv").good();
    let one = records(&folder.read("one.csv"));
    assert_eq!(one.len(), 3);
    assert!(one.iter().all(|row| row["rank"] == "1" && row["file"] == "a.csv"));
}

#[test]
fn the_summary_file_is_written_whole_or_not_at_all() {
    let folder = laboratory();
    let named = "a file other than";
    assert_refused(
        &folder,
        &[
            refused("on the input", "fit a.csv -m lambert --summary ./a.csv", &["--summary", "a.csv", named]),
            refused(
                "on -o",
                "fit a.csv -m lambert -o r.json --summary r.json",
                &["--summary r.json", named, "-o"],
            ),
            refused("in a missing folder", "fit a.csv -m lambert --summary no/s.csv", &["no/s.csv"]),
            refused("on a folder", "fit a.csv -m lambert --summary .", &["folder"]),
        ],
    );
    // What is there when the time is over is written.
    let run = folder.brdfit("fit a.csv b.csv -m lambert --timeout 1e-9 --summary s.csv -q");
    assert_eq!(run.code, Some(1));
    let rows = records(&folder.read("s.csv"));
    assert!(rows.len() == 3 && rows.iter().all(|row| row["file"] == "a.csv"), "{rows:?}");
}

#[test]
fn completions_are_scripts() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = folder.brdfit(&format!("completions {shell}")).good().stdout;
        for word in ["brdfit", "kubelka-munk", "hold-out"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
        folder.write(shell, script);
    }
    // The shell itself reads its script, and then completes with it.
    let bash =
        |arguments: &[&str]| Command::new("bash").args(arguments).current_dir(folder.path(".")).output();
    if let Ok(read) = bash(&["-n", "bash"]) {
        assert!(read.status.success() && read.stderr.is_empty(), "{read:?}");
        let complete = "source ./bash; COMP_WORDS=(brdfit kub); COMP_CWORD=1; _brdfit brdfit kub brdfit; echo ${COMPREPLY[@]}";
        let found = bash(&["--norc", "-c", complete]).unwrap();
        assert_eq!(String::from_utf8_lossy(&found.stdout).trim(), "kubelka-munk", "{found:?}");
    }
    assert_refused(&folder, &[refused("unknown shell", "completions tcsh", &["'tcsh'", "bash"])]);
}

#[test]
fn manual_pages_are_written_for_every_subcommand() {
    let folder = Folder::new();
    folder.brdfit("man pages/man1").good();
    let help = folder.brdfit("--help").good().stdout;
    let commands = help.split("Commands:").nth(1).unwrap().split("\n\n").next().unwrap();
    let names =
        commands.lines().filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
    let mut pages: Vec<String> = names.map(|name| format!("brdfit-{name}.1")).collect();
    assert!(pages.len() > 14);
    pages.push("brdfit.1".to_owned());
    for page in &pages {
        let text = folder.read(&format!("pages/man1/{page}"));
        for section in [".SH NAME", ".SH SYNOPSIS", ".SH DESCRIPTION"] {
            assert!(text.contains(section), "{page}: {section}");
        }
        let mut groff = Command::new("groff");
        groff.args(["-man", "-ww", "-Tutf8", "-z", page]).current_dir(folder.path("pages/man1"));
        let run = groff.output();
        if let Ok(run) = run {
            assert!(run.status.success() && run.stderr.is_empty(), "{page}: {run:?}");
        }
    }
    assert_eq!(folder.listing().len(), pages.len() + 2, "no other file");
    folder.write("file", "");
    assert_refused(
        &folder,
        &[refused("a folder below a file", "man file/pages", &["file/pages", "cannot write"])],
    );
}
