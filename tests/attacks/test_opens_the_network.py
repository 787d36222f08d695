"""Attack 28: opens the network, by TCP, UDP, DNS, abstract and file sockets.

Defence: no sockets at all (filter), a network without any interface (namespace).
"""

import socket
import sys

from attacking import TARGET, honest, needs

HOSTILE = """
import socket
opened = []
for what, kind, kind2, address in (("tcp", socket.AF_INET, socket.SOCK_STREAM, ("127.0.0.1", PORT)),
                                   ("udp", socket.AF_INET, socket.SOCK_DGRAM, ("127.0.0.1", PORT)),
                                   ("unix", socket.AF_UNIX, socket.SOCK_STREAM, "\\0TOKEN")):
    try:
        s = socket.socket(kind, kind2)
        s.settimeout(2)
        s.connect(address)
        s.sendall(b"hello")
        opened.append(what)
    except OSError:
        pass
try:
    socket.getaddrinfo("example.com", 80)
    opened.append("dns")
except OSError:
    pass
print("OPENED", opened)
"""


def test_there_is_no_network(attack, level):
    with socket.create_server(("127.0.0.1", 0)) as server, socket.socket(socket.AF_UNIX) as local:
        server.settimeout(0)
        if sys.platform == "linux":
            local.bind("\0" + attack.token)
            local.listen()
        hostile = HOSTILE.replace("PORT", str(server.getsockname()[1])).replace("TOKEN", attack.token)
        record = attack({TARGET: hostile + honest()}, level=level)
    needs(record, "no network")
    assert "OPENED []" in record["sphere_contact"].output
