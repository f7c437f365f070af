//! Tables, pictures and findings, made from records alone: nothing here knows a model.

pub mod averages;
pub mod axes;
pub mod choices;
pub mod curves;
pub mod durations;
pub mod fig07;
pub mod fig08;
pub mod fig10;
pub mod findings;
pub mod hinton;
pub mod markdown;
pub mod multi_csv;
pub mod multi_durations;
pub mod picture;
pub mod published_fig10;
pub mod records_csv;
pub mod searches;
pub mod standings;
pub mod table3;
pub mod text_table;
