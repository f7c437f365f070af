//! Tables, pictures and findings, made from records alone: nothing here knows a model.

pub mod averages;
pub mod durations;
pub mod fig07;
pub mod fig08;
pub mod findings;
pub mod hinton;
pub mod markdown;
pub mod picture;
pub mod records_csv;
pub mod table3;
pub mod text_table;
