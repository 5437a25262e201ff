#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tissue_sim {

/// One tag of an XML text: `<name key="value">`, `</name>` or `<name/>`.
struct XmlTag {
  enum class Kind { open, close, empty };
  Kind kind = Kind::open;
  std::string name;
  std::size_t begin = 0;  ///< of '<'
  std::size_t end = 0;    ///< behind '>'
  long line = 0;          ///< of '<', from 1
  int depth = 0;          ///< elements around it
};

/// The tags of an XML text one after the other, comments, CDATA and declarations left out. Checks that tags end and
/// match, which the parsers behind it report without a line, and that they are not nested deeper than `deepest_xml`:
/// those parsers call themselves for every level, and a file of a few hundred kilobytes ends their stack.
class XmlTags {
 public:
  explicit XmlTags(const std::string& text) : text_(text) {}

  /// False at the end, and where fault() says why there is no next one.
  bool next(XmlTag& tag);

  /// "12: <link> is never closed". Empty while nothing is wrong.
  const std::string& fault() const { return fault_; }

 private:
  struct Open {
    std::string name;
    long line;
  };

  bool fail(long line, const std::string& what);

  const std::string& text_;
  std::size_t at_ = 0;       ///< what lies before is done with
  std::size_t counted_ = 0;  ///< up to here line breaks are counted in line_
  long line_ = 1;
  std::vector<Open> open_;
  std::string fault_;
};

constexpr std::size_t deepest_xml = 100;

/// The value of an attribute of a tag; empty where it is not there. Values stay as they are written.
std::string_view attribute(const std::string& text, const XmlTag& tag, std::string_view name);

}  // namespace tissue_sim
