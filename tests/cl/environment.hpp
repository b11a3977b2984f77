// Test helpers: environment variables and folders that last as long as a test.
#pragma once
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <random>
#include <string>

namespace clerestory {

class ScopedVariable {
 public:
  ScopedVariable(const char* name, const std::string& value) : name_(name) {
    if (const char* old = std::getenv(name)) old_ = old;
    ::setenv(name, value.c_str(), 1);
  }
  ScopedVariable(const ScopedVariable&) = delete;
  ScopedVariable& operator=(const ScopedVariable&) = delete;
  ~ScopedVariable() { old_ ? ::setenv(name_, old_->c_str(), 1) : ::unsetenv(name_); }

 private:
  const char* name_;
  std::optional<std::string> old_;
};

class ScopedFolder {
 public:
  ScopedFolder()
      : path_(std::filesystem::temp_directory_path() / ("clerestory-cl-" + std::to_string(std::random_device()()))) {
    std::filesystem::create_directories(path_);
  }
  ScopedFolder(const ScopedFolder&) = delete;
  ScopedFolder& operator=(const ScopedFolder&) = delete;
  ~ScopedFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }
  std::string string() const { return path_.string(); }

  std::filesystem::path write(const std::string& name, const std::string& content) const {
    const std::filesystem::path file = path_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << content;
    return file;
  }

 private:
  std::filesystem::path path_;
};

/// A folder for tests with death tests in the "threadsafe" style: their children begin the test again, and find the
/// parent's folder through the environment. They end without destructors.
class SharedFolder {
 public:
  SharedFolder() {
    if (std::getenv(variable) == nullptr) ::setenv(variable, made_.emplace().string().c_str(), 1);
  }
  SharedFolder(const SharedFolder&) = delete;
  SharedFolder& operator=(const SharedFolder&) = delete;
  ~SharedFolder() { ::unsetenv(variable); }
  std::filesystem::path path() const { return std::getenv(variable); }
  /// A folder in it.
  std::filesystem::path operator/(const std::string& name) const {
    std::filesystem::create_directories(path() / name);
    return path() / name;
  }

 private:
  static constexpr const char* variable = "CLERESTORY_TEST_FOLDER";
  std::optional<ScopedFolder> made_;
};

/// A folder of drivers with PoCL's alone, for OCL_ICD_VENDORS; false where PoCL is not installed. Asks no OpenCL: the
/// loader and PoCL read their environment once, so a process that is to see another one must not have asked before.
inline bool only_pocl(const std::filesystem::path& drivers) {
  std::error_code error;
  return std::filesystem::copy_file("/etc/OpenCL/vendors/pocl.icd", drivers / "pocl.icd",
                                    std::filesystem::copy_options::overwrite_existing, error);
}

inline std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

}  // namespace clerestory
