//! Colours of pictures.
//!
//! # Source
//! Okabe and Ito 2008, "Color Universal Design", the set of eight, whose colours differ under the common
//! colour blindnesses and, with dashes besides, in grey.

/// Text, outlines, and the model that the chapter proposes.
pub const INK: &str = "#1f2933";
/// Remarks.
pub const QUIET: &str = "#66727f";
/// Background of a plot.
pub const PAPER: &str = "#f1f3f5";
/// Grid lines.
pub const GRID: &str = "#d5dae0";

/// First of the set.
pub const BLACK: &str = "#000000";
/// Second of the set.
pub const ORANGE: &str = "#e69f00";
/// Third of the set.
pub const SKY: &str = "#56b4e9";
/// Fourth of the set.
pub const GREEN: &str = "#009e73";
/// Sixth of the set.
pub const BLUE: &str = "#0072b2";
/// Seventh of the set.
pub const VERMILION: &str = "#d55e00";
/// Eighth of the set.
pub const PURPLE: &str = "#cc79a7";

/// Lines of data that are no model's: first, second, third and fourth.
pub const DATA: [&str; 4] = [BLUE, VERMILION, GREEN, BLACK];
