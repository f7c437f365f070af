//! What all pictures are made of: axes, panels, lines and their colours.

pub mod axis;
pub mod colour;
pub mod hinton;
pub mod line;
pub mod palette;
pub mod panel;
pub mod perspective;
pub mod picture;
