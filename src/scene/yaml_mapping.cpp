#include "yaml_mapping.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <locale>
#include <numeric>
#include <sstream>

#include "one_line.h"

namespace tissue_sim {
namespace {

std::string at(const std::string& file, const YAML::Mark& mark) {
  return file + ":" + std::to_string(mark.line + 1) + ":" + std::to_string(mark.column + 1) + ": ";
}

/// What stands in the file, fit for one line of an error.
std::string shown(const YAML::Node& node) {
  if (node.IsMap()) return "a mapping";
  if (node.IsSequence()) return "a list of " + std::to_string(node.size());
  return node.IsScalar() ? "'" + one_line(node.Scalar().substr(0, 60)) + "'" : "nothing";
}

bool is_plain(const YAML::Node& node) {
  return node.IsScalar() && node.Tag() != "!";
}  // "!": it stands in quotes

/// A finite decimal number and nothing else; NaN for everything else. yaml-cpp's own conversion takes .nan, .inf,
/// hexadecimal and "1.0" in quotes.
double to_number(const std::string& text) {
  double number = std::nan("");
  if (text.find_first_not_of("0123456789.eE+-") != std::string::npos) return number;
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  stream >> number;
  return stream && stream.eof() && std::isfinite(number) ? number : std::nan("");
}

double to_number(const YAML::Node& node) {
  return is_plain(node) ? to_number(node.Scalar()) : std::nan("");
}

/// Neither a number nor true or false; those are texts in quotes only.
bool is_text(const YAML::Node& node) {
  if (!node.IsScalar() || node.Scalar().empty() || node.Scalar().find('\0') != std::string::npos) return false;
  return !is_plain(node) || (node.Scalar() != "true" && node.Scalar() != "false" && std::isnan(to_number(node)));
}

/// Letters to insert, delete or replace on the way from a to b.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] != b[j]);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string join(YamlMapping::Keys words) {
  std::string list;
  for (const char* word : words) list += (list.empty() ? "" : ", ") + std::string(word);
  return list;
}

/// yaml-cpp takes one of them for the end of the file wherever it stands: what follows would be lost.
void refuse_control_characters(const std::string& file, const std::string& text) {
  int line = 1, column = 1;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte < 32 && c != '\t' && c != '\n' && c != '\r') || byte == 127) {
      throw SceneError(file + ":" + std::to_string(line) + ":" + std::to_string(column) + ": scene: holds byte " +
                       std::to_string(byte) + ", which is no text: save it as UTF-8");
    }
    line += c == '\n';
    column = c == '\n' ? 1 : column + 1;
  }
}

/// Hears a document, and lets all pass that is in it.
struct Deaf : YAML::EventHandler {
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

/// 0, 1 or 2, for two or more. YAML::LoadAll never ends on a text that begins with a comma: it finds document after
/// document there, all empty.
int count_documents(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  Deaf handler;
  int documents = 0;
  while (documents < 2 && parser.HandleNextDocument(handler)) ++documents;
  return documents;
}

YAML::Node load(const std::string& file) {
  std::ifstream stream(file);
  std::stringstream text;
  if (!stream || !(text << stream.rdbuf())) {
    throw SceneError(at(file, YAML::Mark()) + "scene: is empty or cannot be read, name a scene file (YAML)");
  }
  refuse_control_characters(file, text.str());
  try {
    const int documents = count_documents(text.str());
    if (documents == 1) return YAML::Load(text.str());
    throw SceneError(at(file, YAML::Mark()) + "scene: holds " + (documents == 0 ? "no" : "more than one") +
                     " YAML document, a scene is one");
  } catch (const YAML::Exception& error) {
    throw SceneError(at(file, error.mark.is_null() ? YAML::Mark() : error.mark) +
                     "scene: is not YAML: " + one_line(error.msg));
  }
}

}  // namespace

YamlMapping::YamlMapping(const std::string& file, Keys known) : file_(file) {
  read(load(file), known);
}

YamlMapping::YamlMapping(const std::string& file, const std::string& path, const YAML::Mark& mark,
                         const YAML::Node& node, Keys known)
    : file_(file), path_(path), mark_(mark) {
  read(node, known);
}

void YamlMapping::read(const YAML::Node& node, Keys known) {
  if (!node.IsMap()) {
    throw SceneError(at(file_, mark_) + (path_.empty() ? "scene" : path_) + ": is " + shown(node) +
                     ", allowed is a mapping with the keys " + join(known));
  }
  for (const auto& pair : node) {
    const YAML::Mark mark = pair.first.Mark();
    const std::string key = pair.first.IsScalar() ? one_line(pair.first.Scalar().substr(0, 60)) : shown(pair.first);
    if (const Entry* first = find(key)) {
      throw SceneError(at(file_, mark) + path_of(key) + ": stands here and in line " +
                       std::to_string(first->mark.line + 1) + ", delete one");
    }
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      const auto nearest = std::min_element(known.begin(), known.end(), [&](const char* a, const char* b) {
        return edit_distance(key, a) < edit_distance(key, b);
      });
      const std::size_t distance = edit_distance(key, *nearest);
      const bool near = distance <= 2 && distance < key.size();
      throw SceneError(at(file_, mark) + path_of(key) + ": is not known here" +
                       (near ? ", did you mean " + std::string(*nearest) + "? Allowed are " : ", allowed are ") +
                       join(known));
    }
    entries_.push_back({key, mark, pair.second});
  }
}

const YamlMapping::Entry* YamlMapping::find(const std::string& key) const {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.key == key; });
  return found == entries_.end() ? nullptr : &*found;
}

std::string YamlMapping::place(const std::string& key) const {
  const Entry* entry = find(key);
  return at(file_, entry ? entry->mark : mark_) + path_of(key) + ": ";
}

void YamlMapping::fail(const std::string& key, const std::string& problem) const {
  throw SceneError(place(key) + one_line(problem));
}

const YAML::Node& YamlMapping::value(const std::string& key) const {
  const Entry* entry = find(key);
  if (!entry) fail(key, "is missing, add it");
  return entry->value;
}

bool YamlMapping::has(const std::string& key) const {
  return find(key) != nullptr;
}

void YamlMapping::require_one_of(Keys keys) const {
  const auto there = std::count_if(keys.begin(), keys.end(), [&](const char* key) { return has(key); });
  if (there != 1) {
    throw SceneError(at(file_, mark_) + path_ + ": has " + std::to_string(there) + " of its keys, allowed is one of " +
                     join(keys));
  }
}

double YamlMapping::number(const std::string& key, const Allowed& allows, const char* allowed) const {
  const double number = to_number(value(key));
  if (std::isnan(number) || !allows(number)) fail(key, "is " + shown(value(key)) + ", allowed is " + allowed);
  return number;
}

double YamlMapping::number(const std::string& key, const Allowed& allows, const char* allowed, double otherwise) const {
  return has(key) ? number(key, allows, allowed) : otherwise;
}

int YamlMapping::whole_number(const std::string& key, int low, int high, int otherwise) const {
  const std::string allowed = "a whole number from " + std::to_string(low) + " to " + std::to_string(high);
  const auto allows = [&](double x) { return x >= low && x <= high && x == std::floor(x); };
  return static_cast<int>(number(key, allows, allowed.c_str(), otherwise));
}

bool YamlMapping::flag(const std::string& key, bool otherwise) const {
  if (!has(key)) return otherwise;
  const YAML::Node& node = value(key);
  if (is_plain(node) && node.Scalar() == "true") return true;
  if (is_plain(node) && node.Scalar() == "false") return false;
  fail(key, "is " + shown(node) + ", allowed are true and false");
}

Vector3 YamlMapping::vector(const std::string& key) const {
  const YAML::Node& node = value(key);
  Vector3 vector = Vector3::Constant(std::nan(""));
  if (node.IsSequence() && node.size() == 3) vector << to_number(node[0]), to_number(node[1]), to_number(node[2]);
  if (vector.allFinite()) return vector;
  fail(key, "is " + shown(node) + (node.IsSequence() && node.size() == 3 ? ", not all finite numbers" : "") +
                ", allowed are three finite numbers: [x, y, z]");
}

Vector3 YamlMapping::vector(const std::string& key, const Vector3& otherwise) const {
  return has(key) ? vector(key) : otherwise;
}

std::string YamlMapping::text(const std::string& key) const {
  const YAML::Node& node = value(key);
  if (!is_text(node)) {
    fail(key, "is " + shown(node) + ", allowed is a text (in quotes if it looks like a number)");
  }
  return node.Scalar();
}

std::vector<std::string> YamlMapping::texts(const std::string& key) const {
  if (!is_list(key)) return {text(key)};
  std::vector<std::string> found;
  for (const auto& item : value(key)) {
    if (!is_text(item)) fail(key, "holds " + shown(item) + ", allowed are a text and a list of texts");
    if (std::count(found.begin(), found.end(), item.Scalar()) > 0) {
      fail(key, "holds " + shown(item) + " twice, delete one");
    }
    found.push_back(item.Scalar());
  }
  if (found.empty()) fail(key, "is an empty list, allowed are a text and a list of texts");
  return found;
}

bool YamlMapping::is_list(const std::string& key) const {
  return has(key) && value(key).IsSequence();
}

double YamlMapping::fraction(const std::string& key) const {
  const YAML::Node& node = value(key);
  double fraction = to_number(node);
  std::string text = node.IsScalar() ? node.Scalar() : "";
  if (!text.empty() && text.back() == '%') {
    text.pop_back();
    if (!text.empty() && text.back() == ' ') text.pop_back();
    fraction = 0.01 * to_number(text);
  }
  if (!std::isnan(fraction) && fraction > 0.0 && fraction <= 1.0) return fraction;
  fail(key, "is " + shown(node) + ", allowed is a part above 0% and at most 100%, such as 5% or 0.05");
}

std::string YamlMapping::name(const std::string& key) const {
  const std::string name = text(key);
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  const auto part = [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '_'; };
  if (!letter(name[0]) || !std::all_of(name.begin(), name.end(), part)) {
    fail(key, "is " + shown(value(key)) + ", allowed is a ROS name: a letter, then letters, digits and _");
  }
  return name;
}

YamlMapping YamlMapping::mapping(const std::string& key, Keys known) const {
  const YAML::Node& node = value(key);
  return YamlMapping(file_, path_of(key), find(key)->mark, node, known);
}

std::vector<YamlMapping> YamlMapping::list(const std::string& key, Keys known) const {
  std::vector<YamlMapping> items;
  if (!has(key)) return items;
  const YAML::Node& node = value(key);
  if (!node.IsSequence()) fail(key, "is " + shown(node) + ", allowed is a list");
  for (const auto& item : node) {
    items.push_back(
        YamlMapping(file_, path_of(key) + "[" + std::to_string(items.size()) + "]", item.Mark(), item, known));
  }
  return items;
}

}  // namespace tissue_sim
