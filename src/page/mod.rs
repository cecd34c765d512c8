//! Pages for a browser that need no other file and ask nobody for anything: a folder of renders
//! ([`report`]) and the elements of a point file ([`viewer`]).

pub mod report;
pub mod viewer;
