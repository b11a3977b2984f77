#include "host/report/staged_folder.hpp"

#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/report/own_files.hpp"
#include "host/report/provenance.hpp"

namespace clerestory {
namespace fs = std::filesystem;
namespace {

void move_path(const fs::path& from, const fs::path& to) {
  if (::rename(from.c_str(), to.c_str()) != 0)
    throw Error(ErrorKind::Failed, "cannot be moved to " + to.string() + ": " + std::strerror(errno), from.string());
}

bool is_mount_point(const fs::path& folder) {
  struct statx status {};
  return ::statx(AT_FDCWD, folder.c_str(), 0, STATX_BASIC_STATS, &status) == 0 &&
         (status.stx_attributes & STATX_ATTR_MOUNT_ROOT) != 0;
}

/// The same folder or file, whatever it is called.
bool is_in(fs::path path, const fs::path& folder) {
  for (std::error_code error;; path = path.parent_path()) {
    if (fs::equivalent(path, folder, error)) return true;
    if (path == path.parent_path()) return false;
  }
}

/// Whether a file, or a link to it on the way that was named, lies in the folder.
bool lies_inside(const fs::path& input, const fs::path& folder) {
  const fs::path named = fs::absolute(input);
  return is_in(fs::weakly_canonical(named), folder) ||
         is_in(fs::weakly_canonical(named.parent_path()) / named.filename(), folder);
}

/// A process that died in the middle of a replacement left the folder that it replaced, and no other is removed.
void remove_replaced(const fs::path& old) {
  if (!fs::exists(old)) return;
  if (!fs::is_directory(old) || (!fs::is_empty(old) && !fs::exists(old / kProvenanceName)))
    throw usage_error("stands where a folder is kept while it is replaced", old.string(), {}, "another name");
  remove_tree(old);
}

}  // namespace

StagedFolder::StagedFolder(const fs::path& target, Replacing replacing)
    : target_(own_path(target)), replacing_(std::move(replacing)) {
  // A link is followed (own_path), so that the folder behind it is replaced and the link stays.
  const fs::path parent = target_.parent_path();
  if (target_ == parent) throw usage_error("cannot be an output folder", target_.string());
  if (is_mount_point(target_))
    throw usage_error("is a mount point, which cannot be replaced as a whole", target_.string(), {}, "a folder in it");
  check_inputs();
  above_.emplace(parent);
  lock_.emplace(target_, LockKind::Write);
  const std::string name = "." + target_.filename().string();
  staging_ = parent / (name + ".partial");
  const fs::path old = parent / (name + ".old");
  // A process that died in the middle of a replacement without RENAME_EXCHANGE left the old folder under another name.
  if (fs::exists(old) && !fs::exists(target_)) move_path(old, target_);
  remove_replaced(old);
  check_target();
  remove_tree(staging_);
  make_directories(staging_);
}

StagedFolder::~StagedFolder() {
  std::error_code ignored;
  if (!committed_) fs::remove_all(staging_, ignored);
}

void StagedFolder::check_inputs() const {
  if (!fs::is_directory(target_)) return;
  for (const fs::path& input : replacing_.inputs)
    if (!input.empty() && lies_inside(input, target_))
      throw usage_error("lies inside of the folder that the results replace", input.string(), target_.string(),
                        "another --out");
}

void StagedFolder::check_target() {
  std::error_code error;
  const auto status = fs::status(target_, error);
  if (!fs::exists(status)) return;
  if (!fs::is_directory(status)) throw usage_error("a file stands where a folder should be", target_.string());
  if (fs::is_empty(target_)) return;
  if (!fs::exists(target_ / kProvenanceName))
    throw usage_error("this folder holds other things and is not replaced", target_.string(), {},
                      fmt::format("a new or empty folder, or one that holds {}", kProvenanceName));
  std::vector<std::string> foreign = foreign_in(target_);
  std::erase_if(foreign, [&](const std::string& name) { return std::ranges::count(given_up_, name) > 0; });
  give_up(foreign, target_, replacing_.force);
  given_up_.insert(given_up_.end(), foreign.begin(), foreign.end());
}

void StagedFolder::commit() {
  check_target();
  if (!fs::exists(target_)) {
    move_path(staging_, target_);
  } else if (::renameat2(AT_FDCWD, staging_.c_str(), AT_FDCWD, target_.c_str(), RENAME_EXCHANGE) == 0) {
    remove_tree(staging_);  // now the old folder
  } else {
    const fs::path old = target_.parent_path() / ("." + target_.filename().string() + ".old");
    move_path(target_, old);
    move_path(staging_, target_);
    remove_tree(old);
  }
  committed_ = true;
}

}  // namespace clerestory
