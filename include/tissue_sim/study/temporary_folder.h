#pragma once

#include <filesystem>
#include <string>

namespace tissue_sim {

/// A folder under the system's temporary one that goes with all that is in it. `name` and the process make its own.
struct TemporaryFolder {
  std::filesystem::path path;

  explicit TemporaryFolder(const std::string& name);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
};

/// Throws SceneError where there is no room.
void write_text(const std::string& text, const std::string& path);

}  // namespace tissue_sim
