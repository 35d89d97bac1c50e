//! `spts live`: the skin under the mouse, on a page of this machine.

use crate::context::{Common, note, print};
use crate::error::CliError;
use crate::options::{pressed, seed};
use clap::Args;
use spts_contact::objects::ObjectSpec;
use spts_live::{LiveConfig, Server, token};
use std::net::{IpAddr, Ipv4Addr};

/// Port that is easy to keep as a bookmark.
const PORT: u16 = 7117;

/// Serves a page on which you press the skin with the mouse and see its wire and two decoded images move.
///
/// By default only this machine can open the page, at http://127.0.0.1:PORT/; no other program and no network is
/// needed. With --token, it also opens through a forwarded port, from outside a container or on another machine.
/// Choose an object, or drop a mesh file onto the page, and press it at any place with any force. Two decoders each
/// show an image from the samples of the wire. For each you choose random or designed rows of the sensing matrix, and M
/// from 5 to 100 measurements. Faults of cells and the noise can be changed at any time. One core gives up to 40
/// updates a second.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts live                          then open the address that it prints
  spts live --object tennis --seed 3
  spts live --port 0                 any free port
  ssh -L 7117:127.0.0.1:7117 HOST    shows the page of a program that runs on HOST at the same port here
  spts live --token                  lets pages in through any port: ssh -L 8080:127.0.0.1:7117 HOST, for example
  spts live --host 0.0.0.0           lets other machines in, and those outside of a container; a token is made

--json prints {\"url\"} on one line, and then serves. Ctrl-C ends it. docs/live.md says what each control does.")]
pub(super) struct LiveCommand {
    /// Address to listen on. At an address other than 127.0.0.1 and ::1, browsers need a token
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    host: IpAddr,
    /// Require a token of browsers, and accept them under any host name and port. TOKEN has 16 to 128 characters:
    /// letters, digits, - and _. If it is omitted, a random token is made and printed [default: no token at 127.0.0.1
    /// and ::1, a random one at other addresses]
    #[arg(long, value_name = "TOKEN", num_args = 0..=1, default_missing_value = "")]
    token: Option<String>,
    /// Port of the address; 0 for any free one
    #[arg(long, value_name = "PORT", default_value_t = PORT)]
    port: u16,
    /// Object at the beginning: one of the seventeen that `spts simulate --list` shows, or finger
    #[arg(long, value_name = "NAME", default_value = "T", value_parser = pressed)]
    object: &'static ObjectSpec,
    /// Seed of the skin: which specimen it is, and its noise
    #[arg(long, value_name = "SEED", default_value_t = 0, value_parser = seed)]
    seed: u64,
    #[command(flatten)]
    common: Common,
}

impl LiveCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let given = self.token.or_else(|| (!self.host.is_loopback()).then(String::new));
        let token = given.map(|given| if given.is_empty() { token() } else { Ok(given) }).transpose()?;
        let object = self.object.name.to_owned();
        let server = Server::bind(&LiveConfig { host: self.host, port: self.port, token, seed: self.seed, object })?;
        let url = server.url();
        if self.common.json {
            // one line, for a script that reads a line and goes on while the page is served
            print(&serde_json::json!({ "url": url }).to_string())?;
        } else {
            print(&url)?;
            note("open this address in a browser; Ctrl-C ends it");
            if !self.host.is_loopback() {
                note("from elsewhere, with this machine's name or published port in it; what is sent is not encrypted");
            }
        }
        Ok(server.run()?)
    }
}
