//! Many files and several models in one run of the program: its time and memory.

use super::inputs::{self, ONE_LOBE};
use super::process::{brdfit, run};
use super::timing::as_f64;
use super::{Setup, markdown};
use std::path::{Path, PathBuf};

const MODELS: [&str; 2] = [ONE_LOBE, "lambert + cook-torrance(d=beckmann)"];

pub fn table(setup: &Setup) -> String {
    let rows: Vec<Vec<String>> = if setup.quick() { [1, 2] } else { [2, 12] }
        .into_iter()
        .map(|count| {
            let files = links(setup, count);
            let folder = setup.folder().join(format!("reports-{count}"));
            std::fs::create_dir(&folder).unwrap();
            let mut command = brdfit();
            command.arg("fit").args(&files).args(MODELS.iter().flat_map(|model| ["-m", model]));
            let done = run(command.arg("-q").arg("-o").arg(&folder));
            let written = std::fs::read_dir(&folder).unwrap().count();
            assert_eq!(written, count, "reports written");
            vec![
                count.to_string(),
                MODELS.len().to_string(),
                format!("{:.2}", done.whole),
                format!("{:.3}", done.whole / as_f64(count * MODELS.len())),
                format!("{:.0}", done.peak_megabytes),
            ]
        })
        .collect();
    let head = ["tables", "models", "whole process s", "s per fit", "peak MB"];
    let models = MODELS.map(|model| format!("`{model}`")).join(" and ");
    format!("{models}, `-o` a folder.\n\n{}", markdown(&head, &rows))
}

/// So many full tables, the given ones under several names.
fn links(setup: &Setup, count: usize) -> Vec<PathBuf> {
    let tables = &setup.inputs.tables;
    let link = |(index, table): (usize, &PathBuf)| {
        let path = setup.folder().join(format!("{count}-{index}-{}", inputs::name(table)));
        link_or_copy(table, &path);
        path
    };
    tables.iter().cycle().take(count).enumerate().map(link).collect()
}

/// Links where the file system can: a database of copies would fill the disk.
fn link_or_copy(from: &Path, to: &Path) {
    if std::fs::hard_link(from, to).is_err() {
        std::fs::copy(from, to).unwrap();
    }
}
