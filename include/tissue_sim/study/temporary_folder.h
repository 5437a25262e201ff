#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace tissue_sim {

/// Throws std::runtime_error where there is no room.
inline void write_text(const std::string& text, const std::string& path) {
  std::ofstream file(path, std::ios::binary);
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  if (!file.flush()) throw std::runtime_error(path + ": cannot be written, is there room in the temporary folder?");
}

/// A folder of its own under the system's temporary one, that goes with all that is in it.
struct TemporaryFolder {
  std::filesystem::path path;

  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "tissue_sim_").string() + std::string(6, 'X');
    if (!mkdtemp(name.data()))
      throw std::runtime_error(name + ": cannot be made, may the temporary folder be written?");
    path = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  /// Makes a file, and the folders that its name begins with. Returns where it is.
  std::string write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((path / name).parent_path());
    write_text(text, (path / name).string());
    return (path / name).string();
  }
};

}  // namespace tissue_sim
