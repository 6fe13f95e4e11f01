//! A figure before it is drawn: every number that it shows, with names and units.

use super::text::Text;
use crate::image::{ColourMap, Image};

/// A figure as data.
#[derive(Clone, Debug)]
pub struct FigureData {
    /// Name of its kind.
    pub kind: &'static str,
    /// The panels, in reading order.
    pub panels: Vec<Panel>,
    /// What the figure shows, in sentences.
    pub caption: Text,
    /// Number of panels side by side in one column of text, and in two.
    pub side_by_side: [usize; 2],
}

/// One panel of a figure.
#[derive(Clone, Debug)]
pub struct Panel {
    /// What it shows; may be empty.
    pub title: Text,
    /// What is in it.
    pub body: Body,
}

/// The content of a panel.
#[derive(Clone, Debug)]
pub enum Body {
    /// Lines and markers over an axis.
    Curves(Curves),
    /// Coloured cells over two axes.
    Map(Map),
    /// An image.
    Picture(Picture),
}

/// Lines and markers over an axis.
#[derive(Clone, Debug)]
pub struct Curves {
    /// How x and y become a place on paper.
    pub axes: Axes,
    /// The horizontal axis, or the angle of a polar one, in degrees from the vertical.
    pub x: Axis,
    /// The vertical axis, or the radius.
    pub y: Axis,
    /// The series, drawn in this order.
    pub series: Vec<Series>,
    /// Places on the x axis to mark.
    pub marks: Vec<Mark>,
}

/// How x and y become a place on paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// At right angles.
    Cartesian,
    /// As angle and radius.
    Polar,
}

/// An axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// The quantity.
    pub quantity: Text,
    /// Its unit; empty for a pure number.
    pub unit: &'static str,
    /// How values are spread along it.
    pub scale: Scale,
    /// The ends; `None` means those of the data.
    pub range: Option<[f64; 2]>,
}

/// How values are spread along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// By their logarithm; values that are not positive are not shown.
    Log,
    /// By their square root.
    Root,
}

impl Axis {
    /// An axis with a linear scale, with the ends of the data.
    #[must_use]
    pub fn new(quantity: impl Into<Text>, unit: &'static str) -> Self {
        Self { quantity: quantity.into(), unit, scale: Scale::Linear, range: None }
    }

    /// An axis for an angle in degrees, named by its symbol.
    #[must_use]
    pub fn angle(symbol: &str) -> Self {
        Self::new(Text::of_symbol(symbol), "deg")
    }

    /// The same axis with these ends.
    #[must_use]
    pub fn from_to(self, low: f64, high: f64) -> Self {
        Self { range: Some([low, high]), ..self }
    }

    /// The same axis with another scale.
    #[must_use]
    pub fn scaled(self, scale: Scale) -> Self {
        Self { scale, ..self }
    }
}

/// Points that belong together.
#[derive(Clone, Debug)]
pub struct Series {
    /// Its name in the legend.
    pub name: Text,
    /// How it is drawn.
    pub look: Look,
    /// The points.
    pub points: Vec<[f64; 2]>,
    /// The low and high end of a band about each point; `None` without one.
    pub band: Option<Vec<[f64; 2]>>,
    /// Whether the legend names it.
    pub in_legend: bool,
}

/// How a series is drawn. Series never differ by colour alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    /// The colour.
    pub colour: Colour,
    /// The line through the points; `None` means no line.
    pub line: Option<Dash>,
    /// The marker at each point; `None` means no markers.
    pub marker: Option<Marker>,
}

/// The colour of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    /// A colour of the categorical palette, which repeats.
    Of(usize),
    /// Black.
    Ink,
    /// Grey, for what stands behind.
    Grey,
}

/// The pattern of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dash {
    /// Solid, dashed, dotted, and patterns of both, which repeat.
    Of(usize),
    /// A thin solid line.
    Thin,
    /// A thin dashed line, for a level.
    Level,
}

/// The marker of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// Circle, square, triangle, diamond and so on, which repeat.
    Of(usize),
    /// A small dot, for many points.
    Dot,
    /// A circle with this number beside it.
    Number(usize),
}

/// A place on the x axis to mark.
#[derive(Clone, Debug)]
pub struct Mark {
    /// What is there.
    pub name: Text,
    /// The place.
    pub x: f64,
    /// The colour.
    pub colour: Colour,
    /// Its form.
    pub form: MarkForm,
}

/// The form of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarkForm {
    /// A line across the panel.
    Line,
    /// An arrow head at the edge that points inwards.
    Arrow,
}

/// Coloured cells over two axes.
#[derive(Clone, Debug)]
pub struct Map {
    /// The horizontal axis, with a range.
    pub x: Axis,
    /// The vertical axis, with a range.
    pub y: Axis,
    /// What the colours mean, with a range.
    pub value: Axis,
    /// The number of cells along x, all of the same width on the axis.
    pub columns: usize,
    /// The number of cells along y, all of the same height on the axis.
    pub rows: usize,
    /// The values row by row, from the smallest y and x; `None` means that nothing is known.
    pub cells: Vec<Option<f64>>,
    /// The colours.
    pub colours: &'static ColourMap,
}

/// An image.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Linear radiance.
    pub image: Image,
    /// The factor that it is shown with.
    pub exposure: f64,
}
