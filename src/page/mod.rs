//! A report as a web page: one file with everything in it, which asks for nothing from elsewhere and runs no script.
//!
//! [`Page::new`] collects what the page says, from reports and their measurements; `page.html` and `style.css` say how it looks. The
//! figures are those of [`crate::figure`].

mod fact;
mod figures;
mod material;
mod model;

use crate::error::{Error, OptionName};
use crate::figure::{IN_THE_DARK, Subject};
use crate::progress::Progress;
use askama::Template;
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use material::Material;
use sha2::{Digest as _, Sha256};
use std::fmt::Write as _;
use std::sync::Arc;

/// A page about one material or several.
#[derive(Debug, Template)]
#[template(path = "page.html")]
pub struct Page {
    title: String,
    version: &'static str,
    materials: Vec<Material>,
    style: String,
}

impl Page {
    /// The page of some fits, each with its report and its measurement. Fits that share a measurement, the same in memory, stand side by
    /// side. Without a `title` the page is called after its material. `typed` spells the options that warnings suggest.
    ///
    /// # Errors
    /// Those of figures that cannot be written; [`Error::Malformed`] for a subject without a report or a measurement. A figure that the
    /// data do not allow is left out, and the page says why.
    pub fn new(
        subjects: &[Subject],
        title: Option<&str>,
        typed: fn(OptionName) -> String,
        progress: &Arc<dyn Progress>,
    ) -> Result<Self, Error> {
        let groups = material::groups(subjects)?;
        let materials: Vec<Material> = groups
            .iter()
            .enumerate()
            .map(|(index, fits)| Material::new(index + 1, fits, typed, progress))
            .collect::<Result<_, _>>()?;
        let own = match materials.as_slice() {
            [only] => only.name.clone(),
            several => format!("{} materials", several.len()),
        };
        let title = title.map_or(own, str::to_owned);
        Ok(Self { title, version: env!("CARGO_PKG_VERSION"), materials, style: style() })
    }

    /// The page as HTML, the same to the byte for the same reports and measurements.
    ///
    /// # Errors
    /// [`Error::Encoding`] if it cannot be written, which is a defect.
    pub fn html(&self) -> Result<String, Error> {
        self.render().map_err(|error| Error::Encoding { format: "HTML", reason: error.to_string() })
    }

    /// What the page may load: the pictures inside it, and the one style sheet that has this hash.
    fn policy(&self) -> String {
        let hash = BASE64_STANDARD.encode(Sha256::digest(&self.style));
        format!(
            "default-src 'none'; img-src data:; style-src 'sha256-{hash}'; base-uri 'none'; form-action 'none'"
        )
    }
}

/// The style sheet, with the colours of figures that are read in the dark.
fn style() -> String {
    let mut style = include_str!("style.css").to_owned();
    style.push_str("@media screen and (prefers-color-scheme: dark) {\n");
    for (light, dark) in IN_THE_DARK {
        for part in ["fill", "stroke"] {
            // Writing to a string cannot fail.
            let _ = writeln!(style, "svg[{part}=\"{light}\"], svg [{part}=\"{light}\"] {{ {part}: {dark} }}");
        }
    }
    style.push_str("}\n");
    style
}
