#include "tissue_sim/study/temporary_folder.h"

#include <unistd.h>

#include <fstream>

#include "tissue_sim/scene/scene.h"

namespace tissue_sim {

namespace fs = std::filesystem;

TemporaryFolder::TemporaryFolder(const std::string& name)
    : path(fs::temp_directory_path() / (name + "_" + std::to_string(getpid()))) {
  fs::create_directories(path);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path, ignored);
}

void write_text(const std::string& text, const std::string& path) {
  std::ofstream file(path, std::ios::binary);
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  if (!file.flush()) throw SceneError(path + ": cannot be written, is there room in the temporary folder?");
}

}  // namespace tissue_sim
