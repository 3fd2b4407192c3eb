//! Inputs as people have them: files of public kinds give the right answer in one try, and nothing is read wrongly without a word.

mod bags;
mod calibrations;
mod child_frames;
mod detections;
mod docks;
mod folder;
mod learning;
mod origins;
mod rounds;
mod tag_maps;
mod trajectories;
