#include "xml_tags.h"

#include <algorithm>

namespace tissue_sim {
namespace {

constexpr const char* blanks = " \t\r\n";

}  // namespace

bool XmlTags::fail(long line, const std::string& what) {
  fault_ = std::to_string(line) + ": " + what;
  return false;
}

bool XmlTags::next(XmlTag& tag) {
  if (!fault_.empty()) return false;
  for (std::size_t at = text_.find('<', at_); at != std::string::npos; at = text_.find('<', at_)) {
    line_ += std::count(text_.begin() + static_cast<long>(counted_), text_.begin() + static_cast<long>(at), '\n');
    counted_ = at;
    std::string end = ">";
    if (text_.compare(at, 4, "<!--") == 0) end = "-->";
    if (text_.compare(at, 2, "<?") == 0) end = "?>";
    if (text_.compare(at, 9, "<![CDATA[") == 0) end = "]]>";
    std::size_t close = at + 1;
    char quote = 0;  // a '>' inside an attribute's value ends nothing
    for (; close < text_.size(); ++close) {
      const char c = text_[close];
      if (end == ">" && c == '<' && !quote) break;
      if (end == ">" && (c == '"' || c == '\'') && (!quote || quote == c)) quote = quote ? '\0' : c;
      if (!quote && text_.compare(close, end.size(), end) == 0) break;
    }
    if (close >= text_.size() || text_[close] == '<') return fail(line_, "a tag is not ended by " + end);
    at_ = close + end.size();
    tag.begin = at;
    tag.end = at_;
    tag.line = line_;
    if (text_[at + 1] == '/') {
      tag.kind = XmlTag::Kind::close;
      tag.name = text_.substr(at + 2, std::min(text_.find_first_of(" \t\r\n>", at + 2), text_.size()) - at - 2);
      if (open_.empty()) return fail(line_, "</" + tag.name + "> closes nothing");
      if (open_.back().name != tag.name) {
        return fail(line_, "</" + tag.name + "> where <" + open_.back().name + "> of line " +
                               std::to_string(open_.back().line) + " should be closed");
      }
      open_.pop_back();
      tag.depth = static_cast<int>(open_.size());
      return true;
    }
    if (text_[at + 1] == '!' || text_[at + 1] == '?') continue;
    const std::size_t name_end = std::min(text_.find_first_of(" \t\r\n/>", at + 1), text_.size());
    tag.name = text_.substr(at + 1, name_end - at - 1);
    tag.depth = static_cast<int>(open_.size());
    tag.kind = text_[close - 1] == '/' ? XmlTag::Kind::empty : XmlTag::Kind::open;
    if (tag.kind == XmlTag::Kind::open) open_.push_back({tag.name, line_});
    if (open_.size() > deepest_xml) {
      return fail(line_, "<" + tag.name + "> stands in more than " + std::to_string(deepest_xml) + " elements");
    }
    return true;
  }
  if (!open_.empty()) return fail(open_.back().line, "<" + open_.back().name + "> is never closed");
  return false;
}

std::string_view attribute(const std::string& text, const XmlTag& tag, std::string_view name) {
  const std::string_view all = std::string_view(text).substr(0, tag.end);
  for (std::size_t at = tag.begin + 1 + tag.name.size(); at < all.size();) {
    const std::size_t begin = all.find_first_not_of(blanks, at);
    const std::size_t equals = all.find('=', std::min(begin, all.size()));
    const std::size_t quote = all.find_first_of("\"'", std::min(equals, all.size()));
    if (quote == std::string_view::npos) break;
    const std::size_t end = all.find(all[quote], quote + 1);
    if (end == std::string_view::npos) break;
    std::string_view key = all.substr(begin, equals - begin);
    key = key.substr(0, key.find_first_of(blanks));
    if (key == name) return all.substr(quote + 1, end - quote - 1);
    at = end + 1;
  }
  return {};
}

}  // namespace tissue_sim
