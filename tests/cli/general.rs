//! What all subcommands share: refusals of mistyped commands, help, pipes and devices; and that the README shows what is printed.

use super::{GOOD, assert_refused, laboratory, refused};
use crate::common::{Folder, only_warnings, typed};
use std::fs;

#[test]
fn bad_paths_are_refused() {
    let folder = Folder::new();
    folder.write("good.csv", GOOD);
    folder.write("folder/inside.txt", "x");
    folder.write("a-file", "x");
    folder.write("scene.json", include_str!("../../data/scenes/studio-sphere.json"));
    assert_refused(
        &folder,
        &[
            refused("missing input", "fit nothing.csv -m lambert", &["nothing.csv", "No such file"]),
            refused("missing input", "info nothing.csv", &["nothing.csv", "No such file"]),
            refused("missing input", "evaluate no/thing.csv -m lambert", &["no/thing.csv", "No such file"]),
            refused("a folder as input", "fit folder -m lambert", &["folder", "cannot read", "directory"]),
            refused("a folder as input", "info folder", &["folder", "cannot read", "directory"]),
            refused("-o in a missing folder", "fit good.csv -m lambert -o no/r.json", &["no/r.json"]),
            refused("-o below a file", "fit good.csv -m lambert -o a-file/r.json", &["a-file/r.json"]),
            refused("a folder below a file", "fit good.csv -m lambert -o a-file/", &["a-file"]),
            refused(
                "evaluate -o in a missing folder",
                "evaluate good.csv -m lambert -o no/r.json",
                &["no/r"],
            ),
            refused("evaluate -o on a folder", "evaluate good.csv -m lambert -o folder", &["folder", "file"]),
            refused(
                "synth -o in a missing folder",
                "synth -m lambert --directions 3 -o no/f.csv",
                &["no/f.csv"],
            ),
            refused("synth -o on a folder", "synth -m lambert --directions 3 -o folder", &["folder", "file"]),
            refused(
                "synth --at a missing file",
                "synth -m lambert --at no.csv -o f.csv",
                &["no.csv", "No such"],
            ),
            refused(
                "synth --at a folder",
                "synth -m lambert --at folder -o f.csv",
                &["folder", "cannot read"],
            ),
            refused(
                "-o on the input",
                "tradeoff good.csv -o good.csv",
                &["good.csv", "a file other than the input"],
            ),
            refused(
                "-o on the input",
                "select good.csv --scene scene.json -o ./good.csv",
                &["good.csv", "a file other than the input"],
            ),
            refused(
                "-o on the scene",
                "select good.csv --scene scene.json -o scene.json",
                &["scene.json", "a file other than the input"],
            ),
            refused(
                "--csv on the input",
                "tradeoff good.csv --csv good.csv",
                &["--csv good.csv", "a file other than the input"],
            ),
            refused(
                "--svg on the input",
                "tradeoff good.csv --svg ./good.csv",
                &["--svg", "good.csv", "a file other than the input"],
            ),
            refused(
                "-o on the directions",
                "synth -m lambert --at good.csv -o good.csv",
                &["-o good.csv", "a file other than the input"],
            ),
            // "Nothing is written": not even the folder that reports would have gone to.
            refused("missing input, -o new/", "fit nothing.csv -m lambert -o new/", &["nothing.csv"]),
            refused("unknown parameter, -o new/", "fit good.csv -m lambert --fix zz=1 -o new/", &["zz"]),
        ],
    );
}

#[test]
fn mistyped_commands_are_refused() {
    let folder = Folder::new();
    folder.write("good.csv", GOOD);
    folder.write("one.csv", GOOD.replace(",g,b", ",sigma_r,b"));
    folder.write("zero-sigma.csv", "theta_i,phi_i,theta_o,phi_o,r,sigma\n10,0,20,180,0.1,0\n");
    folder.write("angles.csv", "theta_i,phi_i,theta_o,phi_o\n10,0,20,180\n");
    folder.write("header.csv", "theta_i,phi_i,theta_o,phi_o\n");
    folder.write("steep.csv", "theta_i,phi_i,theta_o,phi_o,r\n85,0,20,180,0.1\n10,0,81,180,0.1\n");
    let fit = |what: &str, rest: &str, words: &[&str]| refused(what, &format!("fit good.csv {rest}"), words);
    let lambert = |what: &str, rest: &str, words: &[&str]| fit(what, &format!("-m lambert {rest}"), words);
    let ct = |what: &str, rest: &str, words: &[&str]| {
        fit(what, &format!("-m 'lambert + cook-torrance' {rest}"), words)
    };
    let evaluate = |what: &str, rest: &str, words: &[&str]| {
        refused(what, &format!("evaluate good.csv -m lambert {rest}"), words)
    };
    let synth = |what: &str, rest: &str, words: &[&str]| {
        refused(what, &format!("synth -m lambert {rest} -o made.csv"), words)
    };
    let heightfield = |what: &str, rest: &str, words: &[&str]| {
        refused(what, &format!("synth --from-heightfield {rest} -o made.csv"), words)
    };
    let cases = [
        refused("no arguments", "", &["subcommand"]),
        refused("unknown subcommand", "fti good.csv", &["'fti'", "fit"]),
        refused("unknown option", "--verbosity", &["--verbosity"]),
        refused("fit of nothing", "fit", &["INPUT"]),
        refused("fit without an input", "fit -m lambert", &["INPUT"]),
        fit("-m without its value", "-m", &["--model"]),
        lambert("mistyped option", "--metrc l2", &["--metrc", "--metric"]),
        lambert("mistyped short option", "-x", &["-x"]),
        lambert("value for a switch", "--json=yes", &["--json", "yes"]),
        lambert("option of another subcommand", "--set kd=0.5", &["--set"]),
        // models
        fit("empty model", "-m ''", &["model", "expected", "found"]),
        fit("unknown model", "-m lambrt", &["'lambrt'", "did you mean 'lambert'?"]),
        fit("known and unknown model", "-m 'lambert + phongg'", &["'phongg'"]),
        fit("term missing", "-m 'lambert +'", &["model", "expected"]),
        fit("unknown distribution", "-m 'cook-torrance(d=ggy)'", &["'ggy'", "ggx", "beckmann"]),
        fit("unknown option of a model", "-m 'cook-torrance(q=ggx)'", &["'q'", "d"]),
        fit("option of a model without any", "-m 'lambert(d=ggx)'", &["lambert", "option"]),
        fit("option twice", "-m 'cook-torrance(d=ggx, d=ggx)'", &["d", "twice"]),
        fit("option without a value", "-m 'cook-torrance(d)'", &["d=ggx", "'cook-torrance(d)'"]),
        fit("open parenthesis", "-m 'cook-torrance(d=ggx'", &["')'"]),
        fit("text behind the parenthesis", "-m 'cook-torrance(d=ggx)x'", &["')'"]),
        fit("variant of oren-nayar", "-m 'oren-nayar(variant=half)'", &["'half'", "full"]),
        refused("one good and one unknown model", "fit good.csv -m lambert -m lambrt", &["'lambrt'"]),
        refused("evaluate an unknown model", "evaluate good.csv -m lambrt", &["'lambrt'"]),
        refused("models of no model", "models lambrt", &["'lambrt'", "lambert"]),
        refused("synth of no model", "synth -m lambrt --directions 3 -o f.csv", &["'lambrt'"]),
        // values of options
        lambert("unknown metric", "--metric l3", &["'l3'", "l2", "log", "cbrt"]),
        lambert("metric that is only reported", "--metric relative", &["'relative'"]),
        lambert("unknown weights", "--weights heavy", &["'heavy'", "uniform", "sigma"]),
        lambert("sigma without sigma", "--weights sigma", &["good.csv", "sigma"]),
        lambert("solid angles of scattered data", "--weights solid-angle", &["good.csv", "solid-angle"]),
        refused(
            "sigma of zero",
            "fit zero-sigma.csv -m lambert --weights sigma",
            &["zero-sigma.csv", "positive", "found 0"],
        ),
        refused("sigma of some channels", "fit one.csv -m lambert --weights sigma", &["one.csv", "sigma"]),
        lambert("max-theta of 0", "--max-theta 0", &["--max-theta", "found 0"]),
        lambert("max-theta beyond 90", "--max-theta 91", &["--max-theta", "90", "found 91"]),
        lambert("negative max-theta", "--max-theta -5", &["--max-theta", "found -5"]),
        lambert("max-theta NaN", "--max-theta NaN", &["--max-theta", "NaN"]),
        lambert("max-theta infinite", "--max-theta inf", &["--max-theta", "inf"]),
        lambert("max-theta in words", "--max-theta steep", &["--max-theta", "'steep'"]),
        lambert("max-theta with a unit", "--max-theta 80deg", &["--max-theta", "'80deg'"]),
        lambert("samples 0", "--samples 0", &["--samples", "'0'"]),
        lambert("negative samples", "--samples -5", &["--samples", "-5"]),
        lambert("broken samples", "--samples 1.5", &["--samples", "'1.5'"]),
        lambert("samples in words", "--samples most", &["--samples", "'most'", "all"]),
        lambert("threads 0", "--threads 0", &["--threads", "0"]),
        lambert("negative threads", "--threads -1", &["--threads", "-1"]),
        lambert("threads in words", "--threads all", &["--threads", "'all'"]),
        lambert("negative timeout", "--timeout -1", &["--timeout", "-1"]),
        lambert("timeout 0", "--timeout 0", &["--timeout", "0"]),
        lambert("timeout NaN", "--timeout nan", &["--timeout"]),
        lambert("timeout infinite", "--timeout inf", &["--timeout", "inf"]),
        lambert("timeout in words", "--timeout soon", &["--timeout", "'soon'"]),
        lambert("negative seed", "--seed -1", &["--seed", "-1"]),
        lambert("broken seed", "--seed 1.5", &["--seed", "'1.5'"]),
        lambert("unknown format", "--format xyz", &["--format", "'xyz'", "merl", "cornell", "csv"]),
        lambert("unknown bins", "--merl-bins corner", &["--merl-bins", "'corner'", "center", "edge"]),
        lambert("CSV read as Cornell", "--format cornell", &["good.csv:1:", "number of wavelengths"]),
        lambert("CSV read as MERL", "--format merl", &["good.csv", "90 x 90 x 180"]),
        refused(
            "nothing within 80 degrees",
            "fit steep.csv -m lambert",
            &["steep.csv", "2 beyond-max-theta"],
        ),
        lambert("nothing within 5 degrees", "--max-theta 5", &["no usable sample", "4 beyond-max-theta"]),
        // parameters
        lambert("unknown parameter", "--fix zz=1", &["zz", "lambert.kd"]),
        lambert("unknown parameter to free", "--free zz", &["zz", "lambert.kd"]),
        lambert("unknown parameter to start", "--init zz=1", &["zz"]),
        lambert("unknown parameter to bound", "--bounds zz=0..1", &["zz"]),
        lambert("unknown parameter to tie", "--tie zz=kd", &["zz"]),
        lambert("unknown parameter to tie to", "--tie kd.r=zz", &["zz"]),
        lambert("unknown parameter per channel", "--per-channel zz", &["zz"]),
        lambert("unknown parameter to share", "--shared zz", &["zz"]),
        lambert("unknown channel", "--fix kd.x=0.5", &["kd.x", "'x'", "r, g, b"]),
        lambert("unknown channel in brackets", "--fix kd[550]=0.5", &["kd[550]", "'550'", "r, g, b"]),
        lambert("unknown lobe", "--fix lambrt.kd=0.5", &["'lambrt'", "lambert"]),
        lambert("lobe that is not repeated", "--fix lambert#2.kd=0.5", &["'lambert#2'"]),
        ct("channel of a shared parameter", "--fix m.r=0.2", &["m", "shared"]),
        fit(
            "parameter of two lobes",
            "-m 'cook-torrance + cook-torrance' --fix m=0.2",
            &["m", "cook-torrance.m", "cook-torrance#2.m"],
        ),
        lambert("bracket left open", "--fix kd[r=0.5", &["kd[r"]),
        lambert("four parts of a name", "--fix a.b.c.d=0.5", &["a.b.c.d"]),
        lambert("no name", "--fix =1", &["expected a name"]),
        lambert("no value", "--fix kd", &["--fix", "P=V", "'kd'"]),
        lambert("empty value", "--fix kd=", &["--fix", "P=V", "'kd='"]),
        lambert("value in words", "--fix kd=half", &["--fix", "'kd=half'"]),
        lambert("value NaN", "--fix kd=NaN", &["--fix", "'kd=NaN'"]),
        lambert("value infinite", "--fix kd=inf", &["--fix", "'kd=inf'"]),
        lambert("decimal comma", "--fix kd=0,5", &["--fix", "'kd=0,5'"]),
        lambert("fixed above its bounds", "--fix kd=5", &["kd", "0..2", "found 5"]),
        lambert("fixed below its bounds", "--fix kd=-0.1", &["kd", "0..2", "found -0.1"]),
        lambert("fixed outside given bounds", "--fix kd=0.5 --bounds kd=0.6..1", &["kd", "0.6..1", "0.5"]),
        ct("started above its bounds", "--init m=2", &["m", "0.0001..1", "found 2"]),
        ct("started at zero roughness", "--init m=0", &["m", "0.0001..1", "found 0"]),
        lambert("bounds without a range", "--bounds kd", &["--bounds", "P=LO..HI", "'kd'"]),
        lambert("bounds of one number", "--bounds kd=1", &["--bounds", "P=LO..HI", "'kd=1'"]),
        lambert("no upper bound", "--bounds kd=0..", &["--bounds", "P=LO..HI", "'kd=0..'"]),
        lambert("no lower bound", "--bounds kd=..1", &["--bounds", "P=LO..HI", "'kd=..1'"]),
        lambert("bounds in words", "--bounds kd=low..high", &["--bounds", "'kd=low..high'"]),
        lambert("bounds NaN", "--bounds kd=nan..1", &["--bounds", "'kd=nan..1'"]),
        lambert("bounds with a dash", "--bounds kd=0-1", &["--bounds", "P=LO..HI", "'kd=0-1'"]),
        lambert("bounds the wrong way round", "--bounds kd=1..0.5", &["--bounds", "kd", "1..0.5"]),
        lambert("bounds without room", "--bounds kd=0.5..0.5", &["--bounds", "kd", "0.5..0.5"]),
        ct("roughness bounded at zero", "--bounds m=0..0.5", &["--bounds", "m", "above 0"]),
        ct("negative roughness bound", "--bounds m=-1..0.5", &["--bounds", "m", "above 0"]),
        lambert("tied to itself", "--tie kd=kd", &["--tie", "kd=kd", "the same parameter"]),
        lambert("tied to nothing", "--tie kd", &["--tie", "P=Q", "'kd'"]),
        lambert("tied in a circle", "--tie kd.r=kd.g --tie kd.g=kd.r", &["--tie", "circle"]),
        lambert("channel told per channel", "--per-channel kd.r", &["kd.r", "without a channel"]),
        // bad usage is one line however many inputs there are
        refused("two inputs", "fit good.csv one.csv good.csv -m lambert --fix zz=1", &["zz"]),
        refused("two inputs", "fit good.csv good.csv -m lambert --bounds kd=1..0.5", &["--bounds"]),
        refused("two inputs", "fit good.csv good.csv -m lambert --format xyz", &["'xyz'"]),
        refused("two inputs", "fit good.csv good.csv -m lambert --fix kd=5", &["0..2"]),
        // evaluate
        refused("evaluate without an input", "evaluate -m lambert --set kd=0.5", &["INPUT"]),
        refused("evaluate without a model", "evaluate good.csv --set kd=0.5", &["-m EXPR"]),
        evaluate("set without a value", "--set kd", &["--set", "P=V", "'kd'"]),
        evaluate("one of two without a value", "--set kd.r=0.5 kd.g", &["--set", "P=V", "'kd.g'"]),
        evaluate("set nothing", "--set", &["--set"]),
        evaluate("set in words", "--set kd=half", &["--set", "'kd=half'"]),
        evaluate("set an unknown parameter", "--set zz=1", &["zz", "lambert.kd"]),
        evaluate("set an unknown channel", "--set kd.x=1", &["'x'", "r, g, b"]),
        evaluate("set beyond the bounds", "--set kd=3", &["kd", "0..2", "found 3"]),
        evaluate("weights", "--weights sigma", &["good.csv", "sigma"]),
        evaluate("max-theta", "--max-theta 0", &["--max-theta"]),
        evaluate("option of fit", "--fix kd=1", &["--fix"]),
        refused("two inputs to evaluate", "evaluate good.csv good.csv -m lambert", &["good.csv"]),
        // info
        refused("info of nothing", "info", &["INPUT"]),
        refused("info in an unknown format", "info good.csv --format xyz", &["'xyz'"]),
        refused("info of angles", "info angles.csv", &["angles.csv:1:", "values"]),
        // synth
        synth("nowhere to evaluate", "", &["--grid", "--directions", "--at"]),
        synth("two places", "--directions 3 --at angles.csv", &["--directions", "--at"]),
        synth("no directions", "--directions 0", &["--directions", "0"]),
        synth("negative directions", "--directions -3", &["--directions", "-3"]),
        synth("directions in words", "--directions some", &["--directions", "'some'"]),
        synth("more directions than fit in memory", "--directions 99999999999", &["--directions"]),
        synth("unknown grid", "--grid utia", &["--grid", "'utia'", "merl"]),
        synth("no direction in the file", "--at header.csv", &["header.csv", "expected", "found none"]),
        synth("negative noise", "--directions 3 --noise -0.1", &["--noise", "-0.1"]),
        synth("noise NaN", "--directions 3 --noise nan", &["--noise"]),
        synth("infinite noise", "--directions 3 --noise-abs inf", &["--noise-abs"]),
        synth("negative absolute noise", "--directions 3 --noise-abs -1", &["--noise-abs", "-1"]),
        synth("max-theta", "--directions 3 --max-theta 91", &["--max-theta", "91"]),
        synth("unknown parameter", "--directions 3 --set zz=1", &["zz"]),
        synth("value beyond its bounds", "--directions 3 --set kd=3", &["kd", "0..2"]),
        synth("set without a value", "--directions 3 --set kd", &["--set", "P=V"]),
        synth("spectral MERL", "--grid merl --set kd[550]=0.1", &["r, g and b", "'550'"]),
        synth(
            "a height field of a model",
            "--from-heightfield gaussian --set m=0.3",
            &["--from-heightfield", "--model"],
        ),
        refused("synth of nothing", "synth --directions 3 -o f.csv", &["-m EXPR"]),
        heightfield("unknown surface", "waves --set m=0.3", &["'waves'", "gaussian", "v-groove"]),
        heightfield("height field without m", "gaussian", &["--set", "m=V", "nothing"]),
        heightfield("another parameter", "gaussian --set ks=0.3", &["--set", "m=V", "'ks=0.3'"]),
        heightfield("m and another parameter", "gaussian --set m=0.3 ks=1", &["--set", "'m=0.3 ks=1'"]),
        heightfield("m in words", "v-groove --set m=rough", &["--set", "'m=rough'"]),
        heightfield("m beyond its bounds", "v-groove --set m=1.5", &["m", "0.01..1", "found 1.5"]),
        heightfield("m NaN", "v-groove --set m=nan", &["m", "0.01..1", "NaN"]),
        heightfield("height field and directions", "gaussian --set m=0.3 --directions 3", &["--directions"]),
        heightfield("height field and a grid", "gaussian --set m=0.3 --grid merl", &["--grid"]),
        heightfield("height field and noise", "gaussian --set m=0.3 --noise 0.1", &["--noise"]),
        heightfield("no rays", "gaussian --set m=0.3 --rays 0", &["rays", "found 0"]),
        heightfield("rays in words", "gaussian --set m=0.3 --rays many", &["--rays", "'many'"]),
        heightfield("tile too small", "gaussian --set m=0.3 --tile 8", &["tile", "16..128", "found 8"]),
        heightfield("tile of grooves", "v-groove --set m=0.3 --tile 32", &["--tile", "gaussian"]),
        heightfield(
            "facets of a gaussian surface",
            "gaussian --set m=0.3 --facets ggx",
            &["--facets", "v-groove"],
        ),
        heightfield("unknown facets", "v-groove --set m=0.3 --facets flat", &["'flat'", "beckmann", "ggx"]),
        heightfield(
            "incidence at the horizon",
            "gaussian --set m=0.3 --theta-i 30,90",
            &["incidence", "found 90"],
        ),
        heightfield("incidence in words", "gaussian --set m=0.3 --theta-i steep", &["--theta-i", "'steep'"]),
        heightfield(
            "max-theta of a height field",
            "gaussian --set m=0.3 --max-theta 91",
            &["--max-theta", "91"],
        ),
        heightfield(
            "nothing to see",
            "v-groove --set m=0.05 --rays 6400 --theta-i 60 --max-theta 10",
            &["within 10 degrees"],
        ),
        synth("rays of a model", "--directions 3 --rays 5", &["--rays", "--from-heightfield"]),
        synth("incidence of a model", "--directions 3 --theta-i 5", &["--theta-i", "--from-heightfield"]),
        refused("synth to nowhere", "synth -m lambert --directions 3", &["--output"]),
        refused("MERL on stdout", "synth -m lambert --grid merl -o -", &["merl", "-o FILE"]),
    ];
    assert!(cases.len() > 100);
    assert_refused(&folder, &cases);
}

#[test]
fn help_and_version_are_not_errors() {
    let folder = Folder::new();
    for line in
        ["--help", "-h", "help", "fit --help", "evaluate -h", "models --help", "info -h", "synth --help"]
    {
        let run = folder.brdfit(line).good();
        assert!(run.stdout.contains("Usage: brdfit"), "{line}: {}", run.stdout);
    }
    let version = folder.brdfit("--version").good().stdout;
    assert_eq!(version, format!("brdfit {}\n", env!("CARGO_PKG_VERSION")));
}

/// `brdfit models | head -1`: a reader that goes away is nobody's error.
#[cfg(unix)]
#[test]
fn a_closed_pipe_ends_quietly() {
    use std::io::Read as _;
    use std::process::{Command, Stdio};
    let folder = laboratory();
    for line in [
        "models",
        "models --json",
        "--help",
        "info a.csv",
        "fit a.csv -m lambert",
        "fit a.csv b.csv -m lambert --json",
        "evaluate a.csv -m lambert -o -",
        "synth -m lambert --directions 20000 -o -",
    ] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_brdfit"))
            .current_dir(folder.path("."))
            .args(typed(line))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // Closed before anything can have been read.
        drop(child.stdout.take());
        let mut stderr = String::new();
        child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
        let status = child.wait().unwrap();
        assert_eq!(status.code(), Some(0), "{line}");
        assert!(only_warnings(&stderr), "{line}: {stderr}");
    }
}

/// A device cannot be replaced by a file: it is written to.
#[cfg(unix)]
#[test]
fn devices_are_written_directly() {
    use std::os::unix::fs::FileTypeExt as _;
    let folder = laboratory();
    folder.brdfit("fit a.csv -m lambert -q -o /dev/null").good();
    folder.brdfit("synth -m lambert --directions 5 -o /dev/null").good();
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
}

/// What the README shows is what the program prints, but for the time that it took.
#[test]
fn the_readme_shows_real_output() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let block = |kind: &str| {
        let after = readme.split(&format!("```{kind}\n")).nth(1).unwrap();
        after.split("```").next().unwrap().to_owned()
    };
    let commands = readme
        .split("```sh\n")
        .filter_map(|after| after.split("```").next()?.trim().strip_prefix("cargo run --release -- "));
    let arguments =
        commands.into_iter().find(|command| command.starts_with("fit ")).expect("a command that fits a file");
    let (arguments, model) = arguments.split_once(" -m ").unwrap();
    let run = |more: &[&str]| {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_brdfit"))
            .current_dir(root)
            .args(arguments.split(' '))
            .args(["-m", model.trim_matches('"')])
            .args(more)
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let timeless = |text: &str| text.trim_end().rsplit_once(", ").unwrap().0.to_owned();
    let (table, report) = (run(&[]), run(&["--json"]));
    if std::env::var_os("BRDFIT_UPDATE").is_some() {
        // The excerpt keeps its lines; their numbers come from the next line of the report of the same shape.
        let shape = |line: &str| line.replace(|c: char| c.is_ascii_digit() || ".e-".contains(c), "");
        let mut lines = report.lines();
        let excerpt = block("json");
        let excerpt = excerpt.lines().map(|line| match line.trim() {
            "..." => format!("{line}\n"),
            _ => format!("{}\n", lines.find(|found| shape(found) == shape(line)).expect(line)),
        });
        let readme = readme
            .replace(&block("json"), &excerpt.collect::<String>())
            .replace(&block("text"), &format!("{}\n", table.trim_end()));
        std::fs::write(root.join("README.md"), readme).unwrap();
        return;
    }
    assert_eq!(timeless(&table), timeless(&block("text")));

    // Every line of the excerpt stands in the report, in that order.
    let mut lines = report.lines();
    for line in block("json").lines().filter(|line| line.trim() != "...") {
        assert!(lines.any(|found| found == line), "the report does not say {line}");
    }
}
