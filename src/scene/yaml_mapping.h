#pragma once

#include <yaml-cpp/yaml.h>

#include <functional>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "tissue_sim/scene/scene.h"

namespace tissue_sim {

/// True for the numbers that a key takes. Never called with NaN or infinity.
using Allowed = std::function<bool(double)>;

/// One mapping of a scene file, read key by key. Every reader throws SceneError with the key's place and what is
/// allowed there. The constructor refuses keys that are not in `known` and keys that stand twice.
class YamlMapping {
 public:
  using Keys = std::initializer_list<const char*>;

  /// The whole file.
  YamlMapping(const std::string& file, Keys known);

  bool has(const std::string& key) const;
  void require_one_of(Keys keys) const;  ///< exactly one of them is there

  // With a default: the key may be left out. `allowed` says in words what the predicate lets through.
  double number(const std::string& key, const Allowed& allows, const char* allowed) const;
  double number(const std::string& key, const Allowed& allows, const char* allowed, double otherwise) const;
  int whole_number(const std::string& key, int low, int high, int otherwise) const;
  bool flag(const std::string& key, bool otherwise) const;
  Vector3 vector(const std::string& key) const;
  Vector3 vector(const std::string& key, const Vector3& otherwise) const;
  std::string text(const std::string& key) const;
  std::vector<std::string> texts(const std::string& key) const;  ///< a text, or a list of one or more, all different
  bool is_list(const std::string& key) const;                    ///< false if left out
  double fraction(const std::string& key) const;                 ///< `5%` or 0.05: above 0 and at most 1
  std::string name(const std::string& key) const;                ///< a letter, then letters, digits and '_'
  YamlMapping mapping(const std::string& key, Keys known) const;
  std::vector<YamlMapping> list(const std::string& key, Keys known) const;  ///< empty if left out

  /// The value that a word stands for.
  template <typename Value>
  Value choice(const std::string& key, std::initializer_list<std::pair<const char*, Value>> words) const {
    const std::string word = text(key);
    std::string allowed;
    for (const auto& [known, value] : words) {
      if (word == known) return value;
      allowed += (allowed.empty() ? "" : ", ") + std::string(known);
    }
    fail(key, "is '" + word + "', allowed are " + allowed);
  }
  template <typename Value>
  Value choice(const std::string& key, std::initializer_list<std::pair<const char*, Value>> words,
               Value otherwise) const {
    return has(key) ? choice(key, words) : otherwise;
  }

  /// `file:line:column: key: `, the key with the path that leads to it. A key that is not there stands where its
  /// mapping does.
  std::string place(const std::string& key) const;
  [[noreturn]] void fail(const std::string& key, const std::string& problem) const;
  const std::string& file() const { return file_; }

 private:
  struct Entry {
    std::string key;
    YAML::Mark mark;
    YAML::Node value;
  };

  YamlMapping(const std::string& file, const std::string& path, const YAML::Mark& mark, const YAML::Node& node,
              Keys known);
  void read(const YAML::Node& node, Keys known);
  const Entry* find(const std::string& key) const;
  const YAML::Node& value(const std::string& key) const;  ///< throws if it is not there
  std::string path_of(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }

  std::string file_;
  std::string path_;  ///< "organs[0].material"; empty for the whole file
  YAML::Mark mark_;
  std::vector<Entry> entries_;
};

}  // namespace tissue_sim
