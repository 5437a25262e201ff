#include "bag_check.h"

#include <rosbag/chunked_file.h>
#include <rosbag/exceptions.h>
#include <rosbag/stream.h>

#include <cstdint>
#include <fstream>
#include <map>
#include <stdexcept>
#include <vector>

#include "tissue_sim/ros/frames.h"

namespace tissue_sim {
namespace {

const std::string first_line = "#ROSBAG V2.0\n";

/// Of the records' field `op`.
enum : unsigned char { op_message = 2, op_file = 3, op_index = 4, op_chunk = 5, op_chunk_info = 6, op_connection = 7 };

/// Times in an index entry 8, offset 4; connection and count in a chunk info.
constexpr std::uint64_t bytes_of_entry = 12;
constexpr std::uint64_t bytes_of_count = 8;

/// A chunk may say that it is this many times larger once it is unpacked, or this much in all (bytes).
constexpr std::uint64_t largest_packing = 1024;
constexpr std::uint64_t always_allowed = 8'000'000;

struct Fault : std::runtime_error {
  using std::runtime_error::runtime_error;
};

[[noreturn]] void fail(std::uint64_t at, const std::string& what) {
  throw Fault("its record in byte " + std::to_string(at) + " " + what);
}

/// A whole number as it stands in the bytes, the smallest first.
std::uint64_t whole(const char* bytes, int count) {
  std::uint64_t number = 0;
  for (int i = count - 1; i >= 0; --i) number = number << 8 | static_cast<unsigned char>(bytes[i]);
  return number;
}

using Fields = std::map<std::string, std::string>;

/// The fields `name=value` of a record's header, each after its length.
Fields parse_fields(const std::string& header, std::uint64_t at) {
  Fields fields;
  for (std::size_t next = 0; next < header.size();) {
    if (header.size() - next < 4) fail(at, "has a header that is cut short");
    const std::uint64_t length = whole(&header[next], 4);
    next += 4;
    if (length > header.size() - next) fail(at, "has a field that is longer than its header");
    const std::string field = header.substr(next, length);
    const std::size_t equals = field.find('=');
    if (equals == std::string::npos) fail(at, "has a field without a name");
    fields[field.substr(0, equals)] = field.substr(equals + 1);
    next += length;
  }
  return fields;
}

struct Record {
  std::uint64_t at = 0;  ///< of its first byte
  unsigned char op = 0;
  Fields fields;
  std::uint64_t data = 0;  ///< of the first byte after the header and the length
  std::uint64_t length = 0;

  std::uint64_t end() const { return data + length; }
  std::uint64_t number(const std::string& name, int bytes) const {
    const auto field = fields.find(name);
    if (field == fields.end() || field->second.size() != static_cast<std::size_t>(bytes)) {
      fail(at, "has no field '" + name + "' of " + std::to_string(bytes) + " bytes");
    }
    return whole(field->second.data(), bytes);
  }
};

/// Bytes of a file, or of a chunk that was read from one.
class Bytes {
 public:
  explicit Bytes(const std::string& path) : file_(path, std::ios::binary | std::ios::ate) {
    const std::streamoff end = file_.tellg();
    if (end < 0) throw Fault("it cannot be read");
    size_ = static_cast<std::uint64_t>(end);
  }
  explicit Bytes(std::vector<std::uint8_t> memory) : memory_(std::move(memory)), size_(memory_.size()) {}

  std::uint64_t size() const { return size_; }

  std::string read(std::uint64_t at, std::uint64_t length) {
    if (at > size_ || length > size_ - at) fail(at, "reaches past the end");
    if (!memory_.empty())
      return {memory_.begin() + static_cast<long>(at), memory_.begin() + static_cast<long>(at + length)};
    std::string bytes(length, '\0');
    file_.seekg(static_cast<std::streamoff>(at));
    if (!file_.read(&bytes[0], static_cast<std::streamsize>(length))) throw Fault("it cannot be read to its end");
    return bytes;
  }

  Record record(std::uint64_t at) {
    Record record;
    record.at = at;
    const std::uint64_t header = whole(read(at, 4).data(), 4);
    record.fields = parse_fields(read(at + 4, header), at);
    record.op = static_cast<unsigned char>(record.number("op", 1));
    record.length = whole(read(at + 4 + header, 4).data(), 4);
    record.data = at + 8 + header;
    if (record.length > size_ - record.data) {
      fail(at, "announces " + std::to_string(record.length) + " bytes, but only " +
                   std::to_string(size_ - record.data) + " follow");
    }
    return record;
  }

 private:
  std::ifstream file_;
  std::vector<std::uint8_t> memory_;
  std::uint64_t size_ = 0;
};

/// Where the messages of one connection are in a chunk. A long recording has millions of these.
struct Index {
  std::uint64_t at = 0;
  std::uint64_t connection = 0;
  std::uint64_t data = 0;
  std::uint64_t length = 0;
};

struct Chunk {
  Record record;
  std::vector<Index> indices;  ///< that stand behind it
};

/// The bytes of a packed chunk. Where it unpacks to less than it says, rosbag would read what its memory held before:
/// unpacked twice over other bytes, the same must come out.
std::vector<std::uint8_t> unpack(const Record& chunk, rosbag::CompressionType type, std::string packed,
                                 std::uint64_t size) {
  std::vector<std::uint8_t> first(size, 0x00), second(size, 0xff);
  rosbag::ChunkedFile no_file;
  const rosbag::StreamFactory streams(&no_file);
  for (std::vector<std::uint8_t>* to : {&first, &second}) {
    try {
      streams.getStream(type)->decompress(to->data(), static_cast<unsigned>(size),
                                          reinterpret_cast<std::uint8_t*>(&packed[0]),
                                          static_cast<unsigned>(packed.size()));
    } catch (const rosbag::BagException& error) {
      fail(chunk.at, std::string("cannot be unpacked (") + error.what() + ")");
    }
  }
  if (first != second) fail(chunk.at, "unpacks to less than it announces");
  return first;
}

std::vector<std::uint8_t> contents(Bytes& file, const Record& chunk) {
  const auto compression = chunk.fields.find("compression");
  const std::string kind = compression == chunk.fields.end() ? "" : compression->second;
  const std::uint64_t size = chunk.number("size", 4);
  if (kind != "none" && kind != "bz2" && kind != "lz4") fail(chunk.at, "is packed in a way that is not known");
  if (kind == "none" ? size != chunk.length : size > largest_packing * chunk.length + always_allowed) {
    fail(chunk.at, "announces " + std::to_string(size) + " bytes in a chunk of " + std::to_string(chunk.length));
  }
  std::string packed = file.read(chunk.data, chunk.length);
  if (kind == "none") return {packed.begin(), packed.end()};
  return unpack(chunk, kind == "bz2" ? rosbag::compression::BZ2 : rosbag::compression::LZ4, std::move(packed), size);
}

/// Every message that the indices of a chunk name is there, whole.
void check_contents(Bytes& file, const Chunk& chunk) {
  Bytes inside(contents(file, chunk.record));
  std::set<std::uint64_t> messages;
  for (std::uint64_t at = 0; at < inside.size();) {
    const Record record = inside.record(at);
    if (record.op == op_message) messages.insert(at);
    at = record.end();
  }
  for (const Index& index : chunk.indices) {
    const std::string entries = file.read(index.data, index.length);
    for (std::size_t entry = 0; entry < entries.size(); entry += bytes_of_entry) {
      if (messages.count(whole(&entries[entry + 8], 4)) == 0) fail(index.at, "points to a message that is not there");
    }
  }
}

/// The records of a bag, told apart.
struct Outline {
  Record file;
  std::map<std::uint64_t, Chunk> chunks;                  ///< by place
  std::map<std::uint64_t, std::set<std::string>> topics;  ///< of each connection; liars name it twice
  std::vector<Record> tail;                               ///< from where the file header says that the summary begins
};

Outline read_outline(Bytes& file, const Record& header) {
  Outline outline;
  outline.file = header;
  const std::uint64_t summary = header.number("index_pos", 8);
  for (std::uint64_t at = header.end(); at < file.size();) {
    const Record record = file.record(at);
    if (record.op == op_chunk) outline.chunks[at].record = record;
    if (record.op == op_index) {
      if (outline.chunks.empty()) fail(at, "is an index before any chunk");
      if (record.number("count", 4) * bytes_of_entry != record.length) fail(at, "is not as long as its count says");
      outline.chunks.rbegin()->second.indices.push_back({at, record.number("conn", 4), record.data, record.length});
    }
    if (record.op == op_connection) {
      const auto topic = record.fields.find("topic");
      if (topic != record.fields.end()) outline.topics[record.number("conn", 4)].insert(without_slash(topic->second));
    }
    if (at == summary || !outline.tail.empty()) outline.tail.push_back(record);
    at = record.end();
  }
  return outline;
}

/// As many connections as announced, then as many chunk infos, each of a chunk that is there.
void check_summary(Bytes& file, const Outline& outline) {
  const std::uint64_t connections = outline.file.number("conn_count", 4);
  const std::uint64_t infos = outline.file.number("chunk_count", 4);
  if (connections + infos > outline.tail.size()) {
    fail(outline.file.at, "announces " + std::to_string(connections) + " connections and " + std::to_string(infos) +
                              " chunks, but only " + std::to_string(outline.tail.size()) + " records follow");
  }
  for (std::size_t i = 0; i < connections + infos; ++i) {
    const Record& record = outline.tail[i];
    if (i < connections) {
      if (record.op != op_connection) fail(record.at, "stands where a connection should");
      parse_fields(file.read(record.data, record.length), record.at);
      continue;
    }
    if (record.op != op_chunk_info) fail(record.at, "stands where a chunk info should");
    const auto chunk = outline.chunks.find(record.number("chunk_pos", 8));
    if (chunk == outline.chunks.end()) fail(record.at, "points to a chunk that is not there");
    const std::uint64_t count = record.number("count", 4);
    if (count * bytes_of_count != record.length) fail(record.at, "is not as long as its count says");
    if (count > chunk->second.indices.size()) fail(record.at, "names more connections than its chunk has indices");
  }
}

bool holds_any(const Chunk& chunk, const Outline& outline, const std::set<std::string>& topics) {
  for (const Index& index : chunk.indices) {
    const auto named = outline.topics.find(index.connection);
    if (named == outline.topics.end()) continue;
    for (const std::string& topic : named->second) {
      if (topics.count(topic) > 0) return true;
    }
  }
  return false;
}

}  // namespace

std::string fault_in_bag(const std::string& path, const std::set<std::string>& topics) {
  try {
    Bytes file(path);
    if (file.size() < first_line.size() || file.read(0, first_line.size()) != first_line) {
      return "it does not begin with #ROSBAG V2.0: `rosbag fix` lifts an older one";
    }
    const Record header = file.record(first_line.size());
    if (header.op != op_file) fail(header.at, "is not the header of the file");
    if (header.fields.count("encryptor") > 0 && !header.fields.at("encryptor").empty()) return "it is encrypted";
    if (header.number("index_pos", 8) == 0) return "";  // the recording was cut off, and rosbag knows the cure
    const Outline outline = read_outline(file, header);
    check_summary(file, outline);
    for (const auto& at_and_chunk : outline.chunks) {
      const Chunk& chunk = at_and_chunk.second;
      if (holds_any(chunk, outline, topics)) check_contents(file, chunk);
    }
    return "";
  } catch (const Fault& fault) {
    return fault.what();
  }
}

}  // namespace tissue_sim
