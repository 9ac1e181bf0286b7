//! Where a viewer listens.

use crate::failure::{Failure, Outcome};
use std::io::{self, Read, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, TcpStream};
use std::str::FromStr;
use std::time::Duration;

/// How long a viewer may take to answer. Chosen: a network round trip takes well below a second.
const PATIENCE: Duration = Duration::from_secs(3);

/// The address that `--bind` gives, and the port if it gives one. Left out, this machine alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bind {
    /// The address.
    pub ip: IpAddr,
    /// The port; `None` for the usual one, or a free one if that is taken.
    pub port: Option<u16>,
}

impl Default for Bind {
    fn default() -> Self {
        Self {
            ip: Ipv4Addr::LOCALHOST.into(),
            port: None,
        }
    }
}

impl FromStr for Bind {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.replace("localhost", "127.0.0.1");
        let (ip, port) = match (text.parse::<IpAddr>(), text.parse::<SocketAddr>()) {
            (Ok(ip), _) => (ip, None),
            (_, Ok(place)) => (place.ip(), Some(place.port())),
            _ => {
                return Err(
                    "give an address of this machine, e.g. 0.0.0.0 for all, or with a port 127.0.0.1:8080"
                        .to_owned(),
                );
            }
        };
        match port {
            Some(0) => Err("a port is a number from 1 to 65535".to_owned()),
            _ => Ok(Self { ip, port }),
        }
    }
}

impl Bind {
    /// This address with a port.
    pub fn place(&self, port: u16) -> SocketAddr {
        SocketAddr::new(self.ip, port)
    }

    /// The `usual` port, or any free one if that is taken. A port that was asked for is taken by nobody else, or refused.
    pub fn free_port(&self, usual: u16) -> Outcome<u16> {
        self.free_port_but(usual, 0)
    }

    /// The same, and another one than `taken`.
    pub fn free_port_but(&self, usual: u16, taken: u16) -> Outcome<u16> {
        let free = |port| TcpListener::bind(self.place(port));
        let listener = match free(usual) {
            Ok(_) if usual == taken => free(0),
            Err(e) if self.port.is_none() && e.kind() == io::ErrorKind::AddrInUse => free(0),
            other => other,
        };
        let place = listener.and_then(|listener| listener.local_addr());
        place
            .map(|place| place.port())
            .map_err(|e| self.refused(usual, &e))
    }

    fn refused(&self, port: u16, error: &io::Error) -> Failure {
        let place = self.place(port);
        match error.kind() {
            io::ErrorKind::AddrInUse => Failure::user(format!(
                "another program listens at `{place}` already"
            ))
            .with_remedy(
                "name another port with `--bind ADDR:PORT`, or leave the port out for a free one",
            ),
            io::ErrorKind::AddrNotAvailable => {
                Failure::user(format!("`{}` is not an address of this machine", self.ip))
                    .with_remedy("give one that is with `--bind ADDR`, or 0.0.0.0 for all")
            }
            _ => Failure::work(format!("nothing can listen at `{place}` ({error})"))
                .with_remedy("name another address or port with `--bind ADDR:PORT`"),
        }
    }

    /// The page of a recording, for a browser: `page` has the viewer, `data` the recording.
    pub fn page_address(&self, page: u16, data: u16) -> String {
        let (page, data) = (reachable(self.place(page)), reachable(self.place(data)));
        // In a query, such characters are escaped.
        let data = data.to_string().replace(':', "%3A");
        let data = data.replace('[', "%5B").replace(']', "%5D");
        format!("http://{page}/?url=rerun%2Bhttp%3A%2F%2F{data}%2Fproxy")
    }

    /// From which pages a browser may fetch the recording, beside those of 127.0.0.1. The viewer lets no others.
    pub fn origin(&self, page: u16) -> Option<String> {
        match self.ip {
            ip if ip == Ipv4Addr::LOCALHOST => None,
            ip if ip.is_unspecified() => Some(format!("http://*:{page}")),
            _ => Some(format!("http://{}", self.place(page))),
        }
    }
}

/// Where this machine reaches what listens at a place: everywhere includes here.
pub fn reachable(place: SocketAddr) -> SocketAddr {
    let ip = match place.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(ip) if ip.is_unspecified() => Ipv6Addr::LOCALHOST.into(),
        ip => ip,
    };
    SocketAddr::new(ip, place.port())
}

/// Whether anything listens at a place.
pub fn answers(place: SocketAddr) -> bool {
    TcpStream::connect_timeout(&place, PATIENCE).is_ok()
}

/// Whether a viewer listens at a place: it takes no plain page from it, but tells browsers who may ask.
pub fn is_viewer(place: SocketAddr) -> bool {
    answer(place).is_ok_and(|text| {
        text.starts_with("HTTP/1.1") && text.contains("access-control-allow-credentials")
    })
}

/// The start of what a place says to a browser.
fn answer(place: SocketAddr) -> io::Result<String> {
    let mut stream = TcpStream::connect_timeout(&place, PATIENCE)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    write!(
        stream,
        "GET / HTTP/1.1\r\nHost: {place}\r\nConnection: close\r\n\r\n"
    )?;
    let mut start = [0; 1024];
    let length = stream.read(&mut start)?;
    Ok(String::from_utf8_lossy(&start[..length])
        .to_lowercase()
        .replace("http/1.1", "HTTP/1.1"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_may_have_a_port() {
        let bind = |text: &str| text.parse::<Bind>().map(|b| (b.ip.to_string(), b.port));
        assert_eq!(bind("0.0.0.0"), Ok(("0.0.0.0".to_owned(), None)));
        assert_eq!(bind("localhost:80"), Ok(("127.0.0.1".to_owned(), Some(80))));
        assert_eq!(bind("::1"), Ok(("::1".to_owned(), None)));
        assert_eq!(bind("[::]:8080"), Ok(("::".to_owned(), Some(8080))));
        for wrong in [
            "",
            "8080",
            "example.org",
            "127.0.0.1:0",
            "127.0.0.1:99999",
            "1.2.3",
        ] {
            assert!(bind(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_taken_port_is_refused_only_if_it_was_asked_for() {
        let taken = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let port = taken.local_addr().expect("it has an address").port();
        let any = Bind::default();
        let other = any.free_port(port).expect("another one");
        assert_ne!(other, port);
        let asked = Bind {
            port: Some(port),
            ..any
        };
        let failure = asked.free_port(port).expect_err("it is taken");
        let message = failure.message().unwrap_or_default();
        assert!(message.contains(&format!("127.0.0.1:{port}")), "{message}");
        assert_eq!(failure.code(), 2);
        drop(taken);
        assert_eq!(asked.free_port(port), Ok(port));
        assert_ne!(any.free_port_but(port, port), Ok(port));
        // One of the addresses that are kept for examples.
        let elsewhere: Bind = "203.0.113.77".parse().expect("an address");
        let message = elsewhere.free_port(port).map_err(|f| f.message());
        let message = message.expect_err("it is nobody's").unwrap_or_default();
        assert!(
            message.contains("is not an address of this machine"),
            "{message}"
        );
    }

    #[test]
    fn who_listens_everywhere_is_reached_here() {
        let bind: Bind = "0.0.0.0".parse().expect("an address");
        let address = bind.page_address(9090, 9876);
        let expected = "http://127.0.0.1:9090/?url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A9876%2Fproxy";
        assert_eq!(address, expected);
        assert_eq!(bind.origin(9090).as_deref(), Some("http://*:9090"));
        assert_eq!(Bind::default().origin(9090), None);
        let bind: Bind = "::1".parse().expect("an address");
        let address = bind.page_address(9090, 9876);
        assert!(address.starts_with("http://[::1]:9090/"), "{address}");
        assert!(
            address.ends_with("%2F%5B%3A%3A1%5D%3A9876%2Fproxy"),
            "{address}"
        );
        assert_eq!(bind.origin(9090).as_deref(), Some("http://[::1]:9090"));
    }

    #[test]
    fn a_program_that_is_no_viewer_is_none() {
        let other = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let place = other.local_addr().expect("an address");
        let answer = std::thread::spawn(move || {
            let (mut stream, _) = other.accept().expect("a visitor");
            let mut asked = [0; 16];
            stream.read_exact(&mut asked).expect("a question");
            stream
                .write_all(b"HTTP/1.1 200 OK\r\n\r\n")
                .expect("an answer");
        });
        assert!(!is_viewer(place));
        answer.join().expect("it ends");
    }
}
