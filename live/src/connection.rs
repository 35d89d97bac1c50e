//! One page: its WebSocket on one side, a thread with its session on the other.

use crate::UPDATE_S;
use crate::error::LiveError;
use crate::frame::Frame;
use crate::mesh::{MeshUnit, UploadedMesh};
use crate::request::Request;
use crate::server::Shared;
use crate::session::LiveSession;
use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket};
use serde::Serialize;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::mpsc::{Receiver, Sender, channel};

/// Requests that wait for the next update; a page that sends more has to wait.
const WAITING: usize = 256;
/// Messages to the page that wait to be sent; updates beyond them are left out.
const UNSENT: usize = 4;
/// Time in which a page has to take a message.
const PATIENCE: Duration = Duration::from_secs(20);

/// What a session is told.
enum Told {
    Request(Request),
    Mesh(Result<Box<UploadedMesh>, LiveError>),
    Refused(LiveError),
}

/// What a page is told beside frames and shapes.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum Note<'a> {
    /// Something that was refused.
    Error { text: &'a str },
    /// A mesh that presses from now on.
    Mesh { name: &'a str, notes: &'a [String] },
}

/// Serves one page until it is closed.
pub(crate) async fn serve(mut socket: WebSocket, shared: Arc<Shared>) {
    let (told, requests) = channel(WAITING);
    let (shown, mut messages) = channel(UNSENT);
    let ours = Arc::clone(&shared);
    let thread = std::thread::Builder::new().name("session".to_owned());
    if thread.spawn(move || run(&ours, requests, &shown)).is_err() {
        return;
    }
    let mut announced = None;
    loop {
        tokio::select! {
            message = messages.recv() => {
                let Some(text) = message else { return };
                let sent = tokio::time::timeout(PATIENCE, socket.send(Message::text(text))).await;
                if !matches!(sent, Ok(Ok(()))) {
                    return;
                }
            }
            message = socket.recv() => {
                let told_now = match message {
                    None | Some(Err(_) | Ok(Message::Close(_))) => return,
                    Some(Ok(Message::Text(text))) => match Request::from_json(&text) {
                        Ok(Request::Mesh { name, unit }) => {
                            announced = Some((name, unit));
                            continue;
                        }
                        Ok(request) => Told::Request(request),
                        Err(error) => Told::Refused(error),
                    },
                    Some(Ok(Message::Binary(bytes))) => match announced.take() {
                        Some(announced) => {
                            match read_mesh(&shared, announced, bytes, told.clone()) {
                                Ok(()) => continue,
                                Err(error) => Told::Refused(error),
                            }
                        }
                        None => Told::Refused(LiveError::Message("bytes without a name".to_owned())),
                    },
                    Some(Ok(_)) => continue,
                };
                // a session that takes nothing for so long waits for this page to take what it was told
                let taken = tokio::time::timeout(PATIENCE, told.send(told_now)).await;
                if !matches!(taken, Ok(Ok(()))) {
                    return;
                }
            }
        }
    }
}

/// Reads a mesh beside everything else; the session is told of it.
fn read_mesh(
    shared: &Shared,
    (name, unit): (String, MeshUnit),
    bytes: Bytes,
    told: Sender<Told>,
) -> Result<(), LiveError> {
    let Ok(place) = Arc::clone(&shared.meshes).try_acquire_owned() else {
        return Err(LiveError::Message(
            "another mesh is being read; drop it again in a moment".to_owned(),
        ));
    };
    tokio::task::spawn_blocking(move || {
        let read = || UploadedMesh::read(&name, unit, &bytes).map(Box::new);
        // the page waits for an answer, whatever became of its mesh
        let mesh = std::panic::catch_unwind(read)
            .unwrap_or_else(|_| Err(LiveError::Message(format!("{name}: cannot be read"))));
        drop((place, bytes));
        // a page that was closed needs none
        let _ = told.blocking_send(Told::Mesh(mesh));
    });
    Ok(())
}

/// The session of a page: an update every [`UPDATE_S`], until the page is gone.
fn run(shared: &Shared, mut requests: Receiver<Told>, shown: &Sender<String>) {
    let begun = LiveSession::new(Arc::clone(&shared.shelf), shared.seed, &shared.object);
    let mut session = match begun {
        Ok(session) => session,
        Err(error) => {
            tell_error(shown, &error);
            return;
        }
    };
    let greeting = tell(shown, &session.options()).and_then(|()| tell(shown, &session.shape()));
    let mut due = Instant::now();
    let mut open = greeting.is_some();
    while open {
        let (told, gone) = take_all(&mut requests);
        open = !gone && obey(&mut session, told, shown).is_some();
        open = open
            && match session.step() {
                Ok(frame) => show(shown, &frame),
                Err(error) => tell_error(shown, &error).is_some(),
            };
        due = (due + Duration::from_secs_f64(UPDATE_S)).max(Instant::now());
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
    }
}

/// What was told since the last update, and whether nothing will be any more.
fn take_all(requests: &mut Receiver<Told>) -> (Vec<Told>, bool) {
    use tokio::sync::mpsc::error::TryRecvError;
    let mut told = Vec::new();
    // no more than fit: a page that never stops does not keep the skin from being updated
    while told.len() < WAITING {
        match requests.try_recv() {
            Ok(one) => told.push(one),
            Err(TryRecvError::Empty) => break,
            Err(TryRecvError::Disconnected) => return (told, true),
        }
    }
    (told, false)
}

/// Does all that was told; of several objects that are chosen the last one alone. Of several refusals the page sees the
/// last one. `None` when the page is gone.
fn obey(session: &mut LiveSession, told: Vec<Told>, shown: &Sender<String>) -> Option<()> {
    let mut refused = None;
    let mut shape = None;
    let is_object = |one: &Told| matches!(one, Told::Request(Request::Object { .. } | Request::Side { .. }));
    let last_object = told.iter().rposition(is_object);
    for (k, one) in told.into_iter().enumerate() {
        // an object that another one follows at once need not be made
        if is_object(&one) && Some(k) != last_object {
            continue;
        }
        let done = match one {
            Told::Refused(error) => Err(error),
            Told::Request(request) => session.apply(request),
            Told::Mesh(Err(error)) => Err(error),
            Told::Mesh(Ok(mesh)) => {
                let note = Note::Mesh {
                    name: &mesh.name,
                    notes: &mesh.notes,
                };
                tell(shown, &note)?;
                Ok(Some(session.press_with(Arc::from(mesh))))
            }
        };
        match done {
            Ok(new) => shape = new.or(shape),
            Err(error) => refused = Some(error),
        }
    }
    shape.map_or(Some(()), |shape| tell(shown, &shape))?;
    refused.map_or(Some(()), |error| tell_error(shown, &error))
}

/// Shows a frame, unless earlier ones are not sent yet. False when the page is gone.
fn show(shown: &Sender<String>, frame: &Frame) -> bool {
    use tokio::sync::mpsc::error::TrySendError;
    // the text is made only where it is sent
    match shown.try_reserve() {
        Ok(place) => {
            place.send(json(frame));
            true
        }
        Err(TrySendError::Full(())) => true,
        Err(TrySendError::Closed(())) => false,
    }
}

/// Sends a message; waits until it can be sent. `None` when the page is gone.
fn tell(shown: &Sender<String>, message: &impl Serialize) -> Option<()> {
    shown.blocking_send(json(message)).ok()
}

fn tell_error(shown: &Sender<String>, error: &LiveError) -> Option<()> {
    tell(
        shown,
        &Note::Error {
            text: &error.to_string(),
        },
    )
}

fn json(message: &impl Serialize) -> String {
    // structures with names of fields have a JSON
    serde_json::to_string(message).unwrap_or_default()
}
