#include "tissue_sim/scene/resource_path.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "tissue_sim/scene/scene.h"

namespace tissue_sim {
namespace {

namespace fs = std::filesystem;

/// Folders deeper than this below ROS_PACKAGE_PATH are not looked at: workspaces are shallow, /usr/share is not.
constexpr int crawl_depth = 6;

std::vector<fs::path> folders_of(const char* variable) {
  std::vector<fs::path> folders;
  const char* value = std::getenv(variable);
  std::istringstream list(value ? value : "");
  for (std::string folder; std::getline(list, folder, ':');) {
    if (!folder.empty()) folders.emplace_back(folder);
  }
  return folders;
}

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

/// Name of the package whose root `folder` is; empty if it is not one.
std::string package_name(const fs::path& folder) {
  if (!is_file(folder / "package.xml")) return is_file(folder / "manifest.xml") ? folder.filename().string() : "";
  std::ifstream file(folder / "package.xml");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::size_t open = text.find("<name>");
  const std::size_t close = text.find("</name>", open);
  if (open == std::string::npos || close == std::string::npos) return "";
  std::istringstream name(text.substr(open + 6, close - open - 6));
  std::string word;
  name >> word;
  return word;
}

fs::path find_below(const fs::path& folder, const std::string& package, int depth) {
  const std::string name = package_name(folder);
  if (name == package) return folder;
  if (!name.empty() || depth == 0 || is_file(folder / "CATKIN_IGNORE") || is_file(folder / "rospack_nosubdirs")) {
    return {};
  }
  if (package_name(folder / package) == package) return folder / package;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code unreadable;
    if (!entry->is_directory(unreadable) || entry->path().filename().string()[0] == '.') continue;
    const fs::path found = find_below(entry->path(), package, depth - 1);
    if (!found.empty()) return found;
  }
  return {};
}

fs::path find_package(const std::string& package, const fs::path& naming_file) {
  for (const fs::path& root : folders_of("ROS_PACKAGE_PATH")) {
    const fs::path found = find_below(root, package, crawl_depth);
    if (!found.empty()) return found;
  }
  for (const fs::path& prefix : folders_of("CMAKE_PREFIX_PATH")) {
    if (package_name(prefix / "share" / package) == package) return prefix / "share" / package;
  }
  std::error_code error;
  for (fs::path folder = fs::absolute(naming_file, error).parent_path(); folder != folder.parent_path();
       folder = folder.parent_path()) {
    if (package_name(folder) == package) return folder;
  }
  return {};
}

bool starts_with(const std::string& text, const std::string& start) {
  return text.compare(0, start.size(), start) == 0;
}

}  // namespace

std::string resolve_path(const std::string& reference, const std::string& naming_file) {
  fs::path path;
  if (starts_with(reference, "package://")) {
    const std::string rest = reference.substr(10);
    const std::string package = rest.substr(0, rest.find('/'));
    const fs::path root = package.empty() ? fs::path() : find_package(package, naming_file);
    if (root.empty()) {
      throw SceneError(
          "there is no package '" + package + "' for '" + reference +
          "': source the workspace that holds it (ROS_PACKAGE_PATH), or write a path relative to this file");
    }
    path = root / fs::path(rest.substr(std::min(rest.size(), package.size() + 1)));
  } else if (starts_with(reference, "file://")) {
    path = reference.substr(7);
    if (!path.is_absolute()) throw SceneError("'" + reference + "' has no absolute path, write file:///folder/file");
  } else if (reference.find("://") != std::string::npos) {
    throw SceneError("'" + reference + "' cannot be fetched, allowed are package://, file:// and plain paths");
  } else {
    path = fs::path(naming_file).parent_path() / reference;  // an absolute reference replaces the folder
  }
  std::error_code error;
  if (fs::is_directory(path, error)) throw SceneError("'" + path.string() + "' is a folder, name a file");
  if (!fs::exists(path, error)) {
    throw SceneError("there is no file '" + path.lexically_normal().string() + "', which '" + reference + "' names");
  }
  // /dev/zero never ends.
  if (!fs::is_regular_file(path, error)) throw SceneError("'" + path.string() + "' is a device or a pipe, name a file");
  return path.lexically_normal().string();
}

}  // namespace tissue_sim
