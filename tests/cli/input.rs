//! Files that no subcommand may accept, those that every one must, and values at the ends of what is allowed.

use super::{GOOD, HEADER, assert_refused, complaints, refused};
use crate::common::{CELLS, Folder, merl_filled, merl_header, shared};
use serde_json::{Value, json};

/// A file that no subcommand may accept: `fit`, `evaluate` and `info` must all name it, and say what was
/// expected and what was found in `words`.
fn assert_bad_files(files: &[(&str, &str, &[u8], &[&str])]) {
    let mut wrong = Vec::new();
    for (what, name, content, words) in files {
        let folder = Folder::new();
        folder.write(name, content);
        folder.write("precious.json", "written before");
        for line in [
            format!("fit {name} -m lambert -o precious.json"),
            format!("fit {name} -m lambert --json -o new.json"),
            format!("evaluate {name} -m lambert --set kd=0.5 -o new.json"),
            format!("info {name}"),
        ] {
            let mut case = refused(what, &line, words);
            case.words.push((*name).to_owned());
            wrong.extend(complaints(&folder, &case));
        }
    }
    assert!(wrong.is_empty(), "{} complaints:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn bad_csv_files_are_refused() {
    let with = |rows: &str| format!("{HEADER}\n10,0,20,180,0.1\n{rows}\n").into_bytes();
    let cases: Vec<(&str, Vec<u8>, &[&str])> = vec![
        ("empty file", b"".to_vec(), &["expected", "empty file"]),
        ("blank lines only", b" \n\n\t\n".to_vec(), &["expected", "found"]),
        ("comments only", b"# nothing\n# at all\n".to_vec(), &["expected", "found"]),
        ("lone header", format!("{HEADER}\n").into(), &["no usable sample"]),
        ("lone header, no line end", HEADER.into(), &["no usable sample"]),
        ("text in a number", with("10,0,20,180,abc"), &[":3:", "number", " r,", "'abc'"]),
        ("text in an angle", with("10,zero,20,180,0.1"), &[":3:", "number", "phi_i", "'zero'"]),
        ("nan in an angle", with("nan,0,20,180,0.1"), &[":3:", "finite", "theta_i", "'nan'"]),
        ("infinity", with("10,0,20,180,inf"), &[":3:", "finite", "'inf'"]),
        ("minus infinity", with("10,0,20,180,-infinity"), &[":3:", "finite", "'-infinity'"]),
        ("beyond the largest number", with("10,0,20,180,1e999"), &[":3:", "finite", "'1e999'"]),
        ("hexadecimal number", with("0x10,0,20,180,0.1"), &[":3:", "number", "'0x10'"]),
        ("two points in a number", with("10,0,20,180,0.1.2"), &[":3:", "number", "'0.1.2'"]),
        ("a unit behind a number", with("10deg,0,20,180,0.1"), &[":3:", "number", "'10deg'"]),
        ("decimal commas", with("10,0,0,0,20,0,180,0,0,1"), &[":3:", "5 fields", "found 10"]),
        ("short row", with("10,0,20,180"), &[":3:", "5 fields", "found 4"]),
        ("long row", with("10,0,20,180,0.1,0.2"), &[":3:", "5 fields", "found 6"]),
        ("last row cut off", with("10,0,2"), &[":3:", "5 fields", "found 3"]),
        (
            "missing angle",
            b"theta_i,phi_i,phi_o,r\n10,0,180,0.1\n".to_vec(),
            &[":1:", "column 'theta_o'", "theta_i,phi_i,phi_o,r"],
        ),
        (
            "angles with other names",
            b"alpha,beta,gamma,delta,r\n10,0,20,180,0.1\n".to_vec(),
            &[":1:", "column 'theta_i'", "alpha", "--columns theta_i=COLUMN"],
        ),
        (
            "no values",
            b"theta_i,phi_i,theta_o,phi_o\n10,0,20,180\n".to_vec(),
            &[":1:", "expected", "values", "found"],
        ),
        ("no header", b"10,0,20,180,0.1\n11,0,20,180,0.1\n".to_vec(), &["expected", "header", "found"]),
        (
            "angle twice",
            b"theta_i,phi_i,theta_i,theta_o,phi_o,r\n1,2,3,4,5,6\n".to_vec(),
            &[":1:", "'theta_i' twice"],
        ),
        (
            "channel twice",
            b"theta_i,phi_i,theta_o,phi_o,r,r\n10,0,20,180,0.1,0.2\n".to_vec(),
            &[":1:", "'r' twice"],
        ),
        (
            "wavelength twice",
            b"theta_i,phi_i,theta_o,phi_o,550,550nm\n10,0,20,180,0.1,0.2\n".to_vec(),
            &[":1:", "'550nm' twice"],
        ),
        (
            "column without a name",
            b"theta_i,phi_i,theta_o,phi_o,,r\n10,0,20,180,0.1,0.2\n".to_vec(),
            &[":1:", "name for every column", "column 5"],
        ),
        (
            "sigma of a channel that is not there",
            b"theta_i,phi_i,theta_o,phi_o,r,sigma_g\n10,0,20,180,0.1,0.01\n".to_vec(),
            &[":1:", "column 'g'", "'sigma_g'", "found"],
        ),
        (
            "sigma alone",
            b"theta_i,phi_i,theta_o,phi_o,sigma\n10,0,20,180,0.1\n".to_vec(),
            &[":1:", "values", "found"],
        ),
        (
            "negative sigma",
            b"theta_i,phi_i,theta_o,phi_o,r,sigma\n10,0,20,180,0.1,-0.01\n".to_vec(),
            &[":2:", "sigma of r", "0 or more", "'-0.01'"],
        ),
        (
            "NaN sigma",
            b"theta_i,phi_i,theta_o,phi_o,r,sigma_r\n10,0,20,180,0.1,NaN\n".to_vec(),
            &[":2:", "finite number", "sigma of r", "'NaN'"],
        ),
        ("theta_i beyond 90", with("95,0,20,180,0.1"), &[":3:", "theta_i", "90 degrees", "found 95"]),
        ("theta_o beyond 90", with("10,0,90.1,180,0.1"), &[":3:", "theta_o", "90 degrees", "found 90.1"]),
        ("negative theta beyond 90", with("10,0,-91,180,0.1"), &[":3:", "theta_o", "found -91"]),
        ("theta of 1e308", with("1e308,0,20,180,0.1"), &[":3:", "theta_i", "90 degrees", "found"]),
        (
            "bad UTF-8",
            [b"theta_i,phi_i,theta_o,phi_o,r\n10,0,20,180,0.1\n10,0,20,180,".as_slice(), b"\xff\xfe\n"]
                .concat(),
            &[":3:", "number for r", "found"],
        ),
        ("UTF-16", [0xff, 0xfe, b't', 0, b'h', 0, b'e', 0].to_vec(), &["expected", "found"]),
        ("zero byte", with("10,0,20,180,0\0.1"), &["expected", "found"]),
        ("binary garbage", (0..=255).cycle().take(5000).collect(), &["expected", "merl", "csv", "found"]),
        ("prose", b"Dear colleague, here is the data.\n".to_vec(), &["expected", "found"]),
        ("JSON", b"{\"theta_i\": [1, 2, 3]}\n".to_vec(), &["expected", "found"]),
        ("unclosed quote", with("\"10,0,20,180,0.1"), &[":3:", "expected", "found"]),
        (
            "line break in a quoted name",
            b"theta_i,phi_i,theta_o,phi_o,\"re\nd\"\n1,2,3,4,x\n".to_vec(),
            &[":1:", "quotes that end on the line where they begin"],
        ),
        (
            "escape sequence in a name",
            b"theta_i,phi_i,theta_o,phi_o,\x1b[31mred\n1,2,3,4,x\n".to_vec(),
            &[":1:", "names without control characters", "[31mred"],
        ),
    ];
    let cases: Vec<(&str, &str, &[u8], &[&str])> =
        cases.iter().map(|(what, content, words)| (*what, "bad.csv", content.as_slice(), *words)).collect();
    assert_bad_files(&cases);
}

#[test]
fn bad_cornell_files_are_refused() {
    let cases: Vec<(&str, &str, &[&str])> = vec![
        ("empty", "", &["expected", "empty file"]),
        ("count of zero", "0\n400\n0 0 0 0 1\n", &[":1:", "number of wavelengths", "'0'"]),
        ("negative count", "-3\n400 500 600\n0 0 0 0 1 2 3\n", &[":1:", "number of wavelengths", "'-3'"]),
        ("huge count", "4000000000\n400\n0 0 0 0 1\n", &[":1:", "number of wavelengths", "'4000000000'"]),
        ("count of 2^63 - 1", "9223372036854775807\n400\n", &[":1:", "number of wavelengths"]),
        (
            "count beyond 64 bits",
            "99999999999999999999\n400\n0 0 0 0 1\n",
            &["expected", "found '99999999999999999999'"],
        ),
        ("count that is no integer", "1.5\n400\n0 0 0 0 1\n", &["expected", "found '1.5'"]),
        ("count too large", "# c\n3\n400 500\n", &[":3:", "3 wavelengths", "found 2"]),
        ("count larger than the list", "3\n400 500\n0.1 0 0.2 0 1 2\n", &["expected", "found"]),
        ("count smaller than the list", "2\n400 500 600\n0.1 0 0.2 0 1 2\n", &[":2:", "expected", "found"]),
        (
            "sample on the line of the wavelengths",
            "1\n400 0.1 0 0.2 0 1\n0.1 0 0.2 0 1\n",
            &[":2:", "expected", "found"],
        ),
        ("count alone", "2\n", &[":1:", "2 wavelengths", "found 0"]),
        ("no samples", "2\n400 500\n", &["no usable sample"]),
        ("text as a wavelength", "2\n400 blue\n", &[":2:", "wavelength", "'blue'"]),
        ("NaN as a wavelength", "2\n400 NaN\n", &[":2:", "wavelength", "'NaN'"]),
        ("negative wavelength", "2\n400 -500\n", &[":2:", "wavelength", "'-500'"]),
        ("wavelength twice", "2\n400 400.0\n", &[":2:", "wavelength", "'400.0'"]),
        (
            "truncated row",
            "2\n400 500\n0.1 0 0.2 0 1 2\n0.1 0 0.2 0 1\n",
            &[":4:", "4 angles and 2 values", "5"],
        ),
        ("long row", "2\n400 500\n0.1 0 0.2 0 1 2 3\n", &[":3:", "4 angles and 2 values", "7"]),
        ("angles alone", "2\n400 500\n0.1 0 0.2\n", &[":3:", "4 angles and 2 values", "3"]),
        ("text in a value", "1\n400\n0.1 0 0.2 0 x\n", &[":3:", "number", "400", "'x'"]),
        ("infinity in a value", "1\n400\n0.1 0 0.2 0 inf\n", &[":3:", "finite", "400", "'inf'"]),
        ("text in an angle", "1\n400\n0.1 north 0.2 0 1\n", &[":3:", "number", "phi_i", "'north'"]),
        ("decimal commas", "1\n400\n0,1 0 0,2 0 1,5\n", &[":3:", "number", "'0,1'"]),
        ("degrees in place of radians", "1\n400\n50 0 20 0 1\n", &[":3:", "theta_i", "90 degrees", "found"]),
        ("theta_o below the horizon", "1\n400\n0.1 0 1.6 0 1\n", &[":3:", "theta_o", "found 91.67"]),
        ("theta_o of 1e308", "1\n400\n0.1 0 1e308 0 1\n", &[":3:", "theta_o", "90 degrees"]),
    ];
    let cases: Vec<(&str, &str, &[u8], &[&str])> =
        cases.iter().map(|(what, content, words)| (*what, "bad.brdf", content.as_bytes(), *words)).collect();
    assert_bad_files(&cases);
}

#[test]
fn bad_merl_files_are_refused() {
    // The most that a header can claim: none of it may be allocated or multiplied.
    let huge = merl_header([i32::MAX; 3]);
    let cut = |bytes: usize| -> Vec<u8> {
        let mut table = merl_header([90, 90, 180]);
        table.resize(bytes, 0);
        table
    };
    let whole = 12 + 3 * 8 * CELLS;
    assert_eq!(whole, 34_992_012); // the size of the files of the MERL database
    let floats = 12 + 3 * 4 * CELLS;
    let dimensions = |d: [i32; 3]| [merl_header(d), vec![0; 1000]].concat();
    let cases: Vec<(&str, Vec<u8>, &[&str])> = vec![
        ("empty", vec![], &["expected", "empty file"]),
        ("one byte", vec![90], &["byte 0", "90 x 90 x 180", "found"]),
        ("eleven bytes", cut(11), &["byte 0", "90 x 90 x 180", "11 bytes"]),
        ("header alone", cut(12), &["byte 12", "34992012 bytes", "found 12"]),
        ("a few cells", cut(1000), &["byte 1000", "34992012 bytes", "found 1000"]),
        ("one byte short", cut(whole - 1), &["byte 34992011", "34992012 bytes", "found 34992011"]),
        ("one byte long", cut(whole + 1), &["byte 34992012", "34992012 bytes", "found 34992013"]),
        (
            "one byte short of 32-bit floats",
            cut(floats - 1),
            &["byte 17496011", "17496012", "found 17496011 (truncated)"],
        ),
        (
            "one byte more than 32-bit floats",
            cut(floats + 1),
            &["byte 17496013", "17496012", "found 17496013 (truncated)"],
        ),
        ("wrong dimensions", dimensions([90, 90, 360]), &["byte 0", "90 x 90 x 180", "90 x 90 x 360"]),
        ("dimensions in another order", dimensions([180, 90, 90]), &["byte 0", "found 180 x 90 x 90"]),
        ("zero dimensions", dimensions([0, 0, 0]), &["byte 0", "found 0 x 0 x 0"]),
        ("negative dimensions", dimensions([-90, -90, -180]), &["byte 0", "found -90 x -90 x -180"]),
        ("huge dimensions", huge, &["byte 0", "90 x 90 x 180", "found 2147483647 x"]),
        ("dimensions whose product overflows to 0", dimensions([1 << 30, 4, 16]), &["byte 0", "found"]),
        (
            "big-endian header alone",
            [90_i32, 90, 180].map(i32::to_be_bytes).concat(),
            &["byte 12", "34992012 bytes", "17496012 with 32-bit floats", "found 12"],
        ),
        ("text", GOOD.replace("theta", "x").into(), &["expected", "found"]),
        ("nothing measured", merl_filled(-1.0), &["no usable sample", "1458000 not-measured"]),
        ("nothing finite", merl_filled(f64::NAN), &["no usable sample", "not-finite"]),
    ];
    let cases: Vec<(&str, &str, &[u8], &[&str])> = cases
        .iter()
        .map(|(what, content, words)| (*what, "bad.binary", content.as_slice(), *words))
        .collect();
    assert_bad_files(&cases);
}

/// Headers may claim anything: with 1 GB of address space the claims must still be refused as such.
#[cfg(unix)]
#[test]
fn headers_do_not_decide_about_memory() {
    let folder = Folder::new();
    folder.write("huge.binary", merl_header([i32::MAX; 3]));
    folder.write("huge.brdf", "9223372036854775807\n400\n");
    folder.write("many.brdf", "99999\n400\n0 0 0 0 1\n");
    for name in ["huge.binary", "huge.brdf", "many.brdf"] {
        let output = assert_cmd::Command::new("sh")
            .current_dir(folder.path("."))
            .args(["-c", "ulimit -v 1000000 && exec \"$0\" info \"$1\"", env!("CARGO_BIN_EXE_brdfit"), name])
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{name}: {stderr}");
        assert!(stderr.contains(name) && stderr.contains("expected"), "{stderr}");
    }
}

/// Formats that the program does not read (yet): one line that helps.
#[test]
fn measured_files_of_other_formats_are_refused() {
    for name in [
        "more/radiance-xml/2011-SA1.xml",
        "more/asam-openmaterial/asphalt_camera_brdf.xompt",
        "more/fourier-bsdf/paint.bsdf.gz",
        "nist-strd/Gauss1.dat",
        "published/published_params.csv",
    ] {
        let Some(path) = shared(name) else { continue };
        let folder = Folder::new();
        let run = folder.run([
            "fit".as_ref(),
            path.as_os_str(),
            "-m".as_ref(),
            "lambert".as_ref(),
            "-o".as_ref(),
            "r.json".as_ref(),
        ]);
        println!("{}", run.stderr);
        assert_eq!(run.code, Some(2), "{run:?}");
        assert_eq!(run.stdout, "");
        assert_eq!(run.stderr.matches('\n').count(), 1, "{run:?}");
        assert!(!run.stderr.chars().any(|c| c.is_control() && c != '\n'), "{run:?}");
        assert!(run.stderr.contains(path.file_name().unwrap().to_str().unwrap()), "{run:?}");
        assert!(run.stderr.contains("expected") && run.stderr.contains("found"), "{run:?}");
        // Either the formats that exist, or what this one lacks.
        let formats = ["merl", "cornell", "csv"].iter().all(|format| run.stderr.contains(format));
        assert!(formats || run.stderr.contains("column 'theta_i'"), "{run:?}");
        assert!(folder.listing().is_empty());
    }
}

/// What spreadsheets and other systems do to a CSV without harming it.
#[test]
fn unusual_but_valid_files_are_read() {
    let plain = GOOD.to_owned();
    let quoted: String = GOOD.lines().map(|l| format!("\"{}\"\n", l.replace(',', "\",\""))).collect();
    let cases = [
        ("CRLF", plain.replace('\n', "\r\n")),
        ("byte-order mark", format!("\u{feff}{plain}")),
        ("byte-order mark and CRLF", format!("\u{feff}{}", plain.replace('\n', "\r\n"))),
        ("comments and blank lines", format!("# made by hand\n\n{plain}\n# end\n\n")),
        ("byte-order mark before a comment", format!("\u{feff}# made by hand\n{plain}")),
        ("blanks around fields", plain.replace(',', " , ")),
        ("no line end", plain.trim_end().to_owned()),
        ("quotes", quoted),
        ("exponents and signs", plain.replace("0.10", "+1.0e-1")),
        ("columns in another order", {
            let swap = |line: &str| {
                let f: Vec<&str> = line.split(',').collect();
                [f[4], f[3], f[5], f[2], f[1], f[6], f[0]].join(",") + "\n"
            };
            plain.lines().map(swap).collect()
        }),
    ];
    let folder = Folder::new();
    folder.write("good.csv", &plain);
    let expected = folder.brdfit("fit good.csv -m lambert --json").good().json();
    for (what, content) in cases {
        folder.write("other.csv", content);
        let run = folder.brdfit("fit other.csv -m lambert --json");
        assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{what}");
        let report = run.json();
        assert_eq!(report["data"]["format"], "csv", "{what}");
        assert_eq!(report["data"]["used"], 4, "{what}");
        assert_eq!(report["data"]["channels"], json!(["r", "g", "b"]), "{what}");
        assert_eq!(report["errors"], expected["errors"], "{what}");
        assert_eq!(report["parameters"], expected["parameters"], "{what}");
    }
}

/// Values and directions at the ends of what is allowed: any exit code of the contract, but no panic.
#[test]
fn extreme_values_do_not_panic() {
    let rows = [
        "90,0,90,180,1e308",
        "90,0,90,0,1",
        "0,0,0,0,1e-308",
        "89.9999,0,89.9999,180,-1e300",
        "45,1e300,45,-1e300,0",
        "-90,0,90,0,5e-324",
        "0,0,0,0,-0",
    ];
    let folder = Folder::new();
    let mut cases: Vec<String> = rows.iter().map(|row| format!("{HEADER}\n{row}\n")).collect();
    cases.push(format!("{HEADER}\n{}\n", rows.join("\n")));
    cases.push(format!("{HEADER}\n{}", "30,0,40,180,0\n".repeat(50)));
    let mut wrong = Vec::new();
    for content in &cases {
        folder.write("x.csv", content);
        let mut lines = vec!["info x.csv --json".to_owned()];
        for options in ["", "--max-theta 90", "--max-theta 90 --metric l2", "--max-theta 90 --metric log"] {
            for model in ["lambert", "oren-nayar", "lambert + cook-torrance", "ashikhmin-shirley"] {
                lines.push(format!("fit x.csv -m '{model}' {options} --json"));
            }
        }
        for line in lines {
            let run = folder.brdfit(&line);
            let good = match run.code {
                Some(2) => run.stdout.is_empty() && run.stderr.lines().count() == 1,
                Some(code @ (0 | 1)) => {
                    let report = serde_json::from_str::<Value>(&run.stdout).unwrap_or_default();
                    line.starts_with("info") || report["termination"]["usable"] == json!(code == 0)
                }
                _ => false,
            };
            if !good || run.stderr.contains("panicked") {
                wrong.push(format!("brdfit {line}: {:?}\n{}{content}", run.code, run.stderr));
            }
        }
    }
    assert!(wrong.is_empty(), "{} complaints:\n{}", wrong.len(), wrong.join("\n"));
}

/// Compressed files are read as what they hold, and named by their own hash.
#[test]
fn files_compressed_by_gzip_are_read() {
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write as _;
    let packed = |bytes: &[u8]| {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    };
    let folder = Folder::new();
    folder.brdfit("synth -m lambert --set kd=0.5 --directions 3000 -o a.csv").good();
    let bytes = std::fs::read(folder.path("a.csv")).unwrap();
    let gzip = packed(&bytes);
    folder.write("a.csv.gz", &gzip);
    let [plain, unpacked] =
        ["a.csv", "a.csv.gz"].map(|name| folder.brdfit(&format!("info {name} --json")).good().json());
    assert_eq!(plain["channels"], unpacked["channels"]);
    assert_eq!(plain["samples"], unpacked["samples"]);
    let of = |bytes: &[u8]| {
        use sha2::Digest as _;
        sha2::Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect::<String>()
    };
    assert_eq!(plain["sha256"], of(&bytes));
    assert_eq!(unpacked["sha256"], of(&gzip));
    // A file that is cut off, one that is damaged, and one that would fill the memory.
    folder.write("cut.csv.gz", &gzip[..gzip.len() / 2]);
    let mut damaged = gzip.clone();
    let place = damaged.len() - 6;
    damaged[place] ^= 0x55;
    folder.write("damaged.csv.gz", &damaged);
    let header = packed(format!("{HEADER}\n").as_bytes());
    let ones = packed(&vec![b'1'; 64 << 20]);
    let many: Vec<u8> = std::iter::once(header.as_slice())
        .chain(std::iter::repeat_n(ones.as_slice(), 20))
        .flatten()
        .copied()
        .collect();
    folder.write("bomb.csv.gz", &many);
    assert_refused(
        &folder,
        &[
            refused("a file that is cut off", "info cut.csv.gz", &["cut.csv.gz"]),
            refused("a damaged file", "info damaged.csv.gz", &["damaged.csv.gz"]),
            refused("1.25 GiB in 1.2 MB", "info bomb.csv.gz", &["more than 1 GiB once unpacked"]),
        ],
    );
}
