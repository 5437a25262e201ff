"""ROS's wire protocol by hand: many publishers in one process, poses faster than rospy sends them, and a subscriber
that does not read."""
import socket
import struct
import threading
import xmlrpc.client
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer


def write_header(connection, **fields):
    entries = [('%s=%s' % field).encode() for field in fields.items()]
    body = b''.join(struct.pack('<I', len(entry)) + entry for entry in entries)
    connection.sendall(struct.pack('<I', len(body)) + body)


def read_exactly(connection, count):
    data = b''
    while len(data) < count:
        part = connection.recv(count - len(data))
        if not part:
            raise ConnectionError('closed after %d of %d bytes' % (len(data), count))
        data += part
    return data


def read_header(connection):
    body = read_exactly(connection, struct.unpack('<I', read_exactly(connection, 4))[0])
    fields = {}
    while body:
        length = struct.unpack('<I', body[:4])[0]
        key, _, value = body[4:4 + length].decode().partition('=')
        fields[key], body = value, body[4 + length:]
    return fields


def message_bytes(message):
    """As they go over the wire, length first."""
    import io
    buffer = io.BytesIO()
    message.serialize(buffer)
    return struct.pack('<I', len(buffer.getvalue())) + buffer.getvalue()


def subscribe(node_uri, topic, kind, caller='/raw_subscriber'):
    """A connection on which the messages of the topic arrive; whether anybody reads them is the caller's affair."""
    code, what, protocol = xmlrpc.client.ServerProxy(node_uri).requestTopic(caller, topic, [['TCPROS']])
    if code != 1:
        raise RuntimeError(what)
    connection = socket.socket()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)  # full soon
    connection.connect((protocol[1], protocol[2]))
    write_header(connection, callerid=caller, topic=topic, type=kind._type, md5sum=kind._md5sum)
    read_header(connection)
    return connection


class Publisher:
    """A node of its own, as far as others see, with one topic. send() goes to all that are connected."""

    class _Quiet(SimpleXMLRPCRequestHandler):
        def log_message(self, *arguments):
            pass

    def __init__(self, master_uri, name, topic, kind):
        self.name, self.topic, self.kind = name, topic, kind
        self.connections = []
        self._listening = socket.create_server(('127.0.0.1', 0))
        self._server = SimpleXMLRPCServer(('127.0.0.1', 0), requestHandler=self._Quiet, logRequests=False)
        port = self._listening.getsockname()[1]
        self._server.register_function(lambda *_: [1, '', ['TCPROS', '127.0.0.1', port]], 'requestTopic')
        self._server.register_function(lambda *_: [1, '', 0], 'publisherUpdate')
        self.uri = 'http://127.0.0.1:%d/' % self._server.server_address[1]
        for work in (self._accept, self._server.serve_forever):
            threading.Thread(target=work, daemon=True).start()
        self._master = xmlrpc.client.ServerProxy(master_uri)
        self._master.registerPublisher(name, topic, kind._type, self.uri)

    def _accept(self):
        while True:
            try:
                connection, _ = self._listening.accept()
            except OSError:
                return  # closed
            read_header(connection)
            write_header(connection, callerid=self.name, topic=self.topic, type=self.kind._type,
                         md5sum=self.kind._md5sum, message_definition='', latching='0')
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.connections.append(connection)

    def send(self, data):
        for connection in self.connections:
            connection.sendall(data)

    def close(self):
        self._master.unregisterPublisher(self.name, self.topic, self.uri)
        for connection in self.connections:
            connection.close()
        self._listening.close()
        self._server.shutdown()
        self._server.server_close()
