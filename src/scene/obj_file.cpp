#include <algorithm>
#include <charconv>
#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "mesh_formats.h"

namespace tissue_sim {
namespace {

/// A number takes no more; longer ones end elsewhere in somebody's buffer.
constexpr std::size_t longest_number = 64;

/// The words of an OBJ text, line by line. A line that ends in a backslash goes on in the next.
class ObjLines {
 public:
  explicit ObjLines(std::string_view text) : text_(text) {}

  long number() const { return number_; }

  bool next(std::vector<std::string_view>& words) {
    words.clear();
    if (at_ >= text_.size()) return false;
    ++number_;
    for (bool goes_on = true; goes_on && at_ < text_.size();) {
      const std::size_t end = std::min(text_.find_first_of("\r\n", at_), text_.size());
      std::string_view line = text_.substr(at_, end - at_);
      goes_on = !line.empty() && line.back() == '\\';
      if (goes_on) line.remove_suffix(1);
      at_ = end + (text_.substr(end, 2) == "\r\n" ? 2 : 1);
      split(line, words);
    }
    return true;
  }

 private:
  static void split(std::string_view line, std::vector<std::string_view>& words) {
    for (std::size_t at = line.find_first_not_of(" \t"); at < line.size(); at = line.find_first_not_of(" \t", at)) {
      const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
      words.push_back(line.substr(at, end - at));
      at = end;
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
  long number_ = 0;
};

[[noreturn]] void fail(long line, const std::string& what) {
  throw std::runtime_error(std::to_string(line) + ": " + what);
}

}  // namespace

std::string plain_obj(const std::string& text) {
  constexpr std::string_view of_numbers = "0123456789+-.eEnNaAiIfF";
  std::string plain;
  plain.reserve(text.size());
  std::int64_t vertices = 0, largest = 0;
  long line_of_largest = 0;
  bool faces = false;
  ObjLines lines(text);
  for (std::vector<std::string_view> words; lines.next(words);) {
    if (words.empty()) continue;
    if (words[0] == "v") {
      if (words.size() < 4) fail(lines.number(), "a vertex has fewer than three coordinates");
      const std::size_t used = words.size() == 5 ? 5 : 4;  // a fourth one divides the others; more are colours
      plain += 'v';
      for (std::size_t i = 1; i < used; ++i) {
        if (words[i].size() > longest_number || words[i].find_first_not_of(of_numbers) != std::string_view::npos) {
          fail(lines.number(), "'" + std::string(words[i].substr(0, 40)) + "' is not a coordinate");
        }
        plain.append(" ").append(words[i]);
      }
      plain += '\n';
      ++vertices;
    } else if (words[0] == "f" && words.size() > 3) {
      if (words.size() > most_corners) fail(lines.number(), "a face has more than 1000 corners");
      faces = true;
      plain += 'f';
      for (std::size_t i = 1; i < words.size(); ++i) {
        const std::string_view word = words[i].substr(0, words[i].find('/'));
        std::int64_t index = 0;
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), index);
        if (index < 0) index += vertices + 1;  // counted back from the last vertex so far
        if (error != std::errc() || end != word.data() + word.size() || index < 1) {
          fail(lines.number(), "'" + std::string(words[i].substr(0, 40)) + "' is not a vertex of a face");
        }
        if (index > largest) {
          largest = index;
          line_of_largest = lines.number();
        }
        plain.append(" ").append(std::to_string(index));
      }
      plain += '\n';
    }
  }
  if (largest > vertices) {
    fail(line_of_largest, "names vertex " + std::to_string(largest) + " of " + std::to_string(vertices));
  }
  return faces ? plain : "";
}

}  // namespace tissue_sim
