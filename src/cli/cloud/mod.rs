//! `nearfar cloud`: surfaces as a cloud of discs, baked, gathered from and looked at.

mod against_rays;
mod bake;
mod cloud_picture;
mod show;

pub(super) use against_rays::TRACED;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::{Args, Subcommand};

use crate::error::Result;

/// Options of `nearfar cloud`.
#[derive(Debug, Args)]
pub(super) struct CloudArgs {
    #[command(subcommand)]
    command: CloudCommand,
}

#[derive(Debug, Subcommand)]
enum CloudCommand {
    /// Bake surface elements (position, normal, area, light) of all surfaces into a point cloud
    /// (PLY).
    Bake(bake::BakeArgs),
    /// Gather occlusion, bent normals, indirect light or sky from a baked cloud: no ray but the
    /// camera's.
    Gather(cloud_picture::GatherArgs),
    /// Show a file of points (PLY) in a page for a browser.
    Show(show::ShowCloudArgs),
}

/// # Errors
/// Those of the command that is asked for.
pub(super) fn cloud(args: &CloudArgs, cancel: &Arc<AtomicBool>) -> Result<()> {
    match &args.command {
        CloudCommand::Bake(args) => bake::bake_to_file(args, cancel),
        CloudCommand::Gather(args) => cloud_picture::gather(args, cancel),
        CloudCommand::Show(args) => show::show_cloud(args),
    }
}
