//! docs/use/models.md is made from the heads of the source files, which are the models' manuals, and must be what they say
//! now. `BRDFIT_UPDATE=1 cargo test --release --test integration models` writes it anew.

use crate::common::{every_variant, manual_of, model_source};
use brdfit::model::{LargestAlbedo, ModelEntry, ParamSpec, REGISTRY, Role, Sharing, largest_albedos};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// The head of a source file as Markdown whose headings, if any, are of the fifth level.
fn manual(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let lines = text.lines().take_while(|line| line.starts_with("//!"));
    let lines = lines.map(|line| line.trim_start_matches("//!").strip_prefix(' ').unwrap_or(""));
    let head = lines.collect::<Vec<_>>().join("\n");
    // Links to other parts of the code lead nowhere from a page.
    let mut plain = String::new();
    let mut rest = head.as_str();
    while let Some(start) = rest.find("](super::").or_else(|| rest.find("](crate::")) {
        let open = rest[..start].rfind('[').unwrap();
        plain += &rest[..open];
        plain += &rest[open + 1..start];
        rest = &rest[start + rest[start..].find(')').unwrap() + 1..];
    }
    plain += rest;
    plain.replace("[`SlopeTable`]", "`SlopeTable`")
}

fn names(entry: &ModelEntry) -> String {
    let (model, _) = entry.build(&[]).unwrap();
    let name = |spec: &ParamSpec| {
        let mut name = format!("`{}`", spec.name);
        if spec.sharing == Sharing::PerChannel {
            name += "*";
        }
        if spec.fixed { format!("({name})") } else { name }
    };
    let of = |role: Role| {
        let specs = model.parameters();
        let named: Vec<String> = specs.iter().filter(|spec| spec.role == role).map(name).collect();
        named.join(" ")
    };
    format!("{} | {}", of(Role::Shape), of(Role::Amplitude))
}

/// What the search of tests/albedos.rs found for a model.
fn energy(entry: &ModelEntry) -> String {
    let searched =
        "a search over the bounds of its shapes, amplitudes from 0 to 1 and incidence up to 89.9 degrees";
    let largest: Vec<LargestAlbedo> = largest_albedos(entry.name).collect();
    if largest.is_empty() {
        return format!("\nLargest albedo: none above 1 was found by {searched}.\n");
    }
    let others =
        if entry.options.is_empty() { "" } else { " Variants that are not listed stay at 1 or below." };
    let mut text = format!(
        "\nLargest albedos found by {searched}:{others}\n\n| variant | albedo | incidence, degrees | at |\n|---|---|---|---|\n"
    );
    for LargestAlbedo { variant, albedo, theta_i_deg, at } in largest {
        writeln!(text, "| `{variant}` | {albedo} | {theta_i_deg} | {at} |").unwrap();
    }
    text
}

fn page() -> String {
    let mut page = String::from(
        "# Models\n\nMade from the heads of the source files by `BRDFIT_UPDATE=1 cargo test --release --test integration models`; a \
         test keeps it fresh. `brdfit models NAME` lists the bounds of every parameter and what an evaluation costs on \
         your machine; [performance.md](../inside/performance.md) has the cost of every variant.\n\n\
         `*` one value per channel; in parentheses: fixed unless freed. Shapes and amplitudes are those of the default \
         variant.\n\n| model | what it is | shapes | amplitudes | reciprocal |\n|---|---|---|---|---|\n",
    );
    for entry in REGISTRY {
        let reciprocal = if entry.reciprocal { "yes" } else { "no" };
        let anchor = format!("[`{0}`](#{0})", entry.name);
        writeln!(page, "| {anchor} | {} | {} | {reciprocal} |", entry.summary, names(entry)).unwrap();
    }
    for entry in REGISTRY {
        write!(page, "\n## {}\n\n{}\n", entry.name, manual(&manual_of(entry.name))).unwrap();
        for option in entry.options {
            let values = (option.values)().iter().map(|v| format!("`{v}`")).collect::<Vec<_>>().join(", ");
            let (key, summary, default) = (option.key, option.summary, option.default);
            write!(page, "\n`{key}` ({summary}): {values}; `{default}` by default.\n").unwrap();
        }
        page += &energy(entry);
    }
    for (folder, title) in [
        ("distribution", "Facet distributions"),
        ("shadowing", "Shadowing and masking"),
        ("fresnel", "Fresnel reflectance"),
    ] {
        write!(page, "\n## {title}\n\n{}\n", manual(&model_source(&format!("parts/{folder}/mod.rs"))))
            .unwrap();
        let mut files: Vec<PathBuf> = fs::read_dir(model_source(&format!("parts/{folder}")))
            .unwrap()
            .map(|file| file.unwrap().path())
            .collect();
        files.sort();
        // Every other file is a part.
        for file in files.iter().filter(|file| !file.ends_with("mod.rs") && !file.ends_with("registry.rs")) {
            let name = file.file_stem().unwrap().to_str().unwrap().replace('_', "-");
            write!(page, "\n### {name}\n\n{}\n", manual(file)).unwrap();
        }
    }
    page
}

#[test]
fn the_page_is_fresh() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/use/models.md");
    let page = page();
    if std::env::var_os("BRDFIT_UPDATE").is_some() {
        fs::write(&path, &page).unwrap();
    }
    let found = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        found == page,
        "docs/use/models.md is not what the sources say: BRDFIT_UPDATE=1 cargo test --release --test integration models"
    );
}

/// Every model's manual has a formula, and its table has every parameter.
#[test]
fn every_manual_is_complete() {
    let mut missing = Vec::new();
    for entry in REGISTRY {
        let manual = manual(&manual_of(entry.name));
        if !manual.contains("```text") {
            missing.push(format!("{}: formula", entry.name));
        }
        let word = |c: char| !(c.is_alphanumeric() || c == '_');
        let mut described = manual.lines().filter_map(|line| line.strip_prefix('|')?.split('|').next());
        let described: Vec<&str> = described.by_ref().flat_map(|cell| cell.split(word)).collect();
        // Parts have manuals of their own.
        let of_a_part = entry.options.iter().any(|o| ["d", "f"].contains(&o.key));
        for spec in entry.variants().iter().flat_map(|(model, _)| model.parameters()) {
            let name = format!("{}: {}", entry.name, spec.name);
            if !of_a_part && !described.contains(&spec.name) && !missing.contains(&name) {
                missing.push(name);
            }
        }
    }
    assert!(missing.is_empty(), "not in the manuals: {missing:?}");
}

/// `model(key=...)` chooses a part or sets a parameter, so that no name may mean both.
#[test]
fn no_option_is_called_like_a_parameter() {
    for (entry, model, choices) in every_variant() {
        let parameters = model.parameters();
        for option in entry.options {
            let clash = parameters.iter().any(|spec| spec.name == option.key);
            assert!(!clash, "{}({}): {}", entry.name, choices.text(), option.key);
        }
    }
}
