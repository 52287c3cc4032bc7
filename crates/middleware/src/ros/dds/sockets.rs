//! The UDP sockets of this host, as Linux lists them.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket},
};

/// By port: the addresses that sockets are bound to, and the numbers that Linux gives them, which are not soon used again.
#[derive(Debug, Default)]
pub(super) struct Sockets(BTreeMap<u16, Vec<(Ipv4Addr, u64)>>);

impl Sockets {
    /// Those that there are now; none where they are not listed.
    pub(super) fn of_this_host() -> Self {
        Self::parse(&fs::read_to_string("/proc/net/udp").unwrap_or_default())
    }

    /// The numbers of the sockets that listen at one of these addresses.
    pub(super) fn at(&self, addresses: &BTreeSet<SocketAddr>) -> BTreeSet<u64> {
        let addresses = addresses.iter().filter(|address| address.is_ipv4());
        let at = addresses.flat_map(|address| {
            let (ip, bound) = (address.ip(), self.0.get(&address.port()));
            bound
                .into_iter()
                .flatten()
                .filter(move |(to, _)| (ip == *to || to.is_unspecified()) && is_own(ip))
        });
        at.map(|(_, number)| *number).collect()
    }

    /// The table of Linux: `man 5 proc`, `/proc/net/udp`.
    fn parse(table: &str) -> Self {
        let mut sockets = Self::default();
        for line in table.lines().skip(1) {
            let mut columns = line.split_ascii_whitespace();
            let local = columns.nth(1).and_then(|local| local.split_once(':'));
            let number = columns.nth(7).and_then(|number| number.parse().ok());
            if let (Some((address, port)), Some(number)) = (local, number)
                && let Ok(address) = u32::from_str_radix(address, 16)
                && let Ok(port) = u16::from_str_radix(port, 16)
            {
                // The address as it lies in memory.
                let address = Ipv4Addr::from(address.to_ne_bytes());
                sockets.0.entry(port).or_default().push((address, number));
            }
        }
        sockets
    }
}

/// Whether an address is one of this host's.
fn is_own(address: IpAddr) -> bool {
    address.is_loopback() || UdpSocket::bind((address, 0)).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &str = "\
   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode ref pointer drops
  406: 0100007F:1CF3 00000000:0000 07 00000000:00000000 00:00000000 00000000     0        0 5151 2 0000000000000000 0
  407: 00000000:1CF5 00000000:0000 07 00000000:00000000 00:00000000 00000000     0        0 5252 2 0000000000000000 0
  408: nonsense
";

    #[cfg(target_endian = "little")]
    #[test]
    fn the_table_of_linux_is_understood() {
        let sockets = Sockets::parse(TABLE);
        let at = |address: [u8; 4], port| {
            let address = SocketAddr::from((address, port));
            sockets.at(&BTreeSet::from([address])).into_iter().next()
        };
        assert_eq!(at([127, 0, 0, 1], 7411), Some(5151));
        assert_eq!(at([127, 0, 0, 2], 7411), None);
        assert_eq!(at([127, 0, 0, 1], 7413), Some(5252));
        assert_eq!(at([127, 0, 0, 1], 7415), None);
        // Another host's: TEST-NET-1 (RFC 5737).
        assert_eq!(at([192, 0, 2, 1], 7413), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_socket_is_there_until_it_is_closed() {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let addresses = BTreeSet::from([socket.local_addr().unwrap()]);
        let numbers = Sockets::of_this_host().at(&addresses);
        assert_eq!(numbers.len(), 1);
        drop(socket);
        assert!(Sockets::of_this_host().at(&addresses).is_disjoint(&numbers));
    }
}
