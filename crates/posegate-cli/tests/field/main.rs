//! Inputs as people have them: files of public kinds give the right answer in one try, and nothing is read wrongly without a word.

mod calibrations;
mod child_frames;
mod docks;
mod rounds;
mod run;
mod tag_maps;
