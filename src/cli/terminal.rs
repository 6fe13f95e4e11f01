//! What standard output and standard error are, and how text is shown there: with colour where there is a terminal that takes it,
//! and folded at its width. A pipe or a file gets the text as it is.

mod fold;

use anstream::{AutoStream, ColorChoice};
use anstyle::{AnsiColor, Style};
use brdfit::lines::{Lines, Role};
use std::io::{self, Write};
use terminal_size::{Width, terminal_size_of};

/// Lines are folded at this width at least: less would leave no room beside the indentation.
const NARROWEST: usize = 20;

/// Where text goes to.
pub struct Terminal {
    /// Number of columns; `None` if it is not a terminal.
    width: Option<usize>,
    /// Whether colours are shown, which `NO_COLOR`, `CLICOLOR`, `CLICOLOR_FORCE` and `TERM` decide too.
    colour: bool,
}

impl Terminal {
    /// Standard output.
    pub fn output() -> Self {
        let (stream, size) = (io::stdout(), terminal_size_of(io::stdout()));
        Self::new(size.map(|(width, _)| width), AutoStream::choice(&stream))
    }

    /// Standard error.
    pub fn error() -> Self {
        let (stream, size) = (io::stderr(), terminal_size_of(io::stderr()));
        Self::new(size.map(|(width, _)| width), AutoStream::choice(&stream))
    }

    fn new(width: Option<Width>, choice: ColorChoice) -> Self {
        let width = width.map(|Width(columns)| usize::from(columns).max(NARROWEST));
        Self { width, colour: choice != ColorChoice::Never }
    }

    /// Number of columns; `None` if it is not a terminal.
    pub fn width(&self) -> Option<usize> {
        self.width
    }

    /// The text as it is to be shown here.
    pub fn shown(&self, text: &Lines) -> String {
        let folded = match self.width {
            Some(width) => fold::folded(text.lines(), width),
            None => text.lines().iter().map(|line| (line.role, line.text.clone())).collect(),
        };
        let lines: Vec<String> = folded.iter().map(|(role, line)| self.painted(style(*role), line)).collect();
        let end = if text.is_open() || lines.is_empty() { "" } else { "\n" };
        lines.join("\n") + end
    }

    /// A message, whose kind such as `warning:` is painted, as it is to be shown here, with its end of line.
    pub fn message(&self, message: &str) -> String {
        let folded = match self.width {
            Some(width) => fold::wrapped(message, width).join("\n"),
            None => message.to_owned(),
        };
        let kind = KINDS.iter().find(|(kind, _)| folded.starts_with(kind));
        match kind.and_then(|(kind, style)| Some((folded.strip_prefix(kind)?, kind, style))) {
            Some((rest, kind, style)) => format!("{}{rest}\n", self.painted(*style, kind)),
            None => folded + "\n",
        }
    }

    fn painted(&self, style: Style, text: &str) -> String {
        if self.colour && !text.is_empty() { format!("{style}{text}{style:#}") } else { text.to_owned() }
    }
}

/// The kinds of messages.
const KINDS: [(&str, Style); 3] = [
    ("error:", AnsiColor::Red.on_default().bold()),
    ("warning:", AnsiColor::Yellow.on_default().bold()),
    ("note:", AnsiColor::Cyan.on_default()),
];

/// The style of a line.
fn style(role: Role) -> Style {
    match role {
        Role::Plain => Style::new(),
        Role::Title | Role::Heading => Style::new().bold(),
        Role::Caution => AnsiColor::Yellow.on_default(),
        Role::Good => AnsiColor::Green.on_default(),
        Role::Bad => AnsiColor::Red.on_default(),
    }
}

/// Writes what a terminal shows, with colours, to a stream, and all of it at once.
pub fn write_shown(
    stream: impl anstream::stream::RawStream + anstream::stream::AsLockedWrite,
    text: &str,
) -> io::Result<()> {
    // What is written has colours only where they are shown; old consoles of Windows need them translated.
    let mut stream = AutoStream::always(stream);
    stream.write_all(text.as_bytes())?;
    stream.flush()
}
