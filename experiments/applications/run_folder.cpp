#include "experiments/applications/run_folder.hpp"

#include <future>

#include "host/error.hpp"
#include "host/io/camera_file.hpp"
#include "host/io/exposure.hpp"
#include "host/io/files.hpp"
#include "host/io/finite.hpp"
#include "host/report/own_files.hpp"
#include "host/report/preview.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// Half where every value fits, float otherwise: a lamp may be brighter than half can say.
void write_radiance(const fs::path& path, const Image& image) {
  write_exr(path, image, fits_half(image) ? ExrType::Half : ExrType::Float);
}

void write_preview(const fs::path& path, const Image& display) { write_png(path, display, Encoding::Linear); }

void require_run(const fs::path& folder) {
  const std::string run = "a folder that `clerestory invert` wrote";
  if (fs::is_regular_file(folder))
    throw usage_error("a file is no run; `clerestory invert` makes one of a photograph", folder.string(), {}, run);
  if (!fs::is_directory(folder)) throw usage_error("there is no such run folder", folder.string(), {}, run);
  for (const char* name : {"camera.json", "photo.exr"})
    if (!fs::exists(folder / name))
      throw usage_error(fmt::format("is no run: it has no {}", name), folder.string(), {}, run);
}

/// Throws naming all maps that a run lacks.
void require_maps(const fs::path& folder) {
  std::vector<std::string> missing;
  for (const char* name : {"albedo.exr", "normal.exr", "depth.exr", "material.exr"})
    if (!fs::exists(folder / name)) missing.emplace_back(name);
  if (!missing.empty())
    throw usage_error(fmt::format("the run has no {}", fmt::join(missing, ", no ")), folder.string(), {},
                      "all maps: what `clerestory invert` writes without --only");
}

/// For reading one run and writing files into a folder, which may be that run, lie in a run, or have to do with none.
std::vector<FolderLock> lock_both(const fs::path& run, const fs::path& folder) {
  std::vector<FolderLock> locks;
  const fs::path into = own_path(folder), from = own_path(run);
  if (into != from) locks.push_back(lock_run(run, LockKind::Read));
  for (fs::path p = into; p != p.parent_path(); p = p.parent_path())
    if (p == from || fs::exists(p / kProvenanceName)) {
      locks.emplace_back(p, p == into ? LockKind::Write : LockKind::Read);
      break;
    }
  return locks;
}

}  // namespace

void write_run(const fs::path& folder, const Scene& scene, const std::optional<Rerender>& rerender) {
  write_camera(folder / "camera.json", scene.camera);
  std::vector<std::future<void>> files;  // written side by side: packing them takes longer than the disk
  const auto file = [&](const auto& write) { files.push_back(std::async(std::launch::async, write)); };
  // Maps are kept as they were rendered, to be replayed.
  file([&] { write_exr(folder / "photo.exr", scene.photo, ExrType::Float); });
  if (!scene.albedo.data.empty()) {
    file([&] { write_exr(folder / "albedo.exr", scene.albedo, ExrType::Float); });
    file([&] { write_preview(folder / "albedo.png", show_radiance(scene.albedo)); });
  }
  if (!scene.normal.data.empty()) {
    file([&] { write_exr(folder / "normal.exr", scene.normal, ExrType::Float); });
    file([&] { write_preview(folder / "normal.png", show_normal(scene.normal)); });
  }
  if (!scene.depth.data.empty()) {
    file([&] { write_exr(folder / "depth.exr", scene.depth, ExrType::Float); });
    file([&] { write_preview(folder / "depth.png", show_depth(scene.depth)); });
  }
  if (!scene.material.data.empty()) {
    file([&] { write_exr(folder / "material.exr", scene.material, ExrType::Float); });
    file([&] { write_preview(folder / "roughness.png", show_unit(channel(scene.material, 0))); });
    file([&] { write_preview(folder / "metallic.png", show_unit(channel(scene.material, 1))); });
  }
  if (rerender) {
    file([&] { write_radiance(folder / "rerender.exr", rerender->radiance); });
    file([&] { write_exr(folder / "stderr.exr", rerender->standard_error, ExrType::Float); });
    file([&] { write_exr(folder / "uncertainty.exr", rerender->uncertainty); });
    file([&] {
      write_preview(folder / "rerender.png", show_radiance(rerender->radiance, shown_exposure(scene.photo)));
    });
    file([&] { write_preview(folder / "uncertainty.png", show_unit(rerender->uncertainty)); });
  }
  for (std::future<void>& written : files) written.get();
}

Scene read_run_maps(const fs::path& folder) {
  require_run(folder);
  Scene scene;
  scene.camera = read_camera(folder / "camera.json").camera;
  const auto read = [&](const char* name, int channels) {
    const fs::path path = folder / name;
    if (!fs::exists(path)) return Image();
    Image map = read_map(path, channels);
    if (map.width != scene.width() || map.height != scene.height())
      throw usage_error("is of another size than the camera", path.string(),
                        fmt::format("{}x{}", map.width, map.height),
                        fmt::format("{}x{}", scene.width(), scene.height()));
    check_finite(map, path);
    return map;
  };
  scene.photo = read("photo.exr", 3);
  scene.albedo = read("albedo.exr", 3), scene.normal = read("normal.exr", 3);
  scene.depth = read("depth.exr", 1), scene.material = read("material.exr", 3);
  return scene;
}

Scene read_run(const fs::path& folder) {
  require_run(folder), require_maps(folder);
  const Scene scene = read_run_maps(folder);
  scene.check(folder.string());
  return scene;
}

Rerender read_rerender(const fs::path& folder) {
  return {read_map(folder / "rerender.exr", 3), read_map(folder / "stderr.exr", 3),
          read_map(folder / "uncertainty.exr", 1)};
}

void inherit_facts(const fs::path& run, Provenance& record) {
  if (!fs::exists(run / kProvenanceName)) return;
  const Provenance made = read_provenance(run / kProvenanceName);
  for (const char* name : {kDepthScaleFact, "camera"})
    if (const auto fact = made.facts.find(name); fact != made.facts.end()) record.facts.insert(*fact);
}

FolderLock lock_run(const fs::path& run, LockKind kind) {
  require_run(run);
  return FolderLock(run, kind);
}

void keep_json_apart(const fs::path& json, const std::vector<fs::path>& results) {
  if (json.empty()) return;
  for (const fs::path& result : results)
    if (fs::weakly_canonical(json) == fs::weakly_canonical(result))
      throw usage_error("would be written twice", "--json", json.string(),
                        "another file than the results and their record");
}

ResultFiles::ResultFiles(const fs::path& run, const fs::path& record, const std::vector<fs::path>& results, bool force,
                         const std::vector<fs::path>& others)
    : folder_(record.has_parent_path() ? record.parent_path() : "."),
      record_(record),
      staging_(folder_ / ("." + record.stem().string() + ".partial")),
      results_(results) {
  require_run(run);
  locks_ = lock_both(run, folder_);
  made_.emplace(folder_);
  lock_.emplace(folder_ / ("." + record.stem().string() + ".lock"), LockKind::Write, folder_);
  std::vector<fs::path> files = results, records = others;
  files.push_back(record), records.push_back(record);
  for (const fs::path& file : files) AtomicFile probe(file);  // never committed: nothing remains
  give_up(foreign_among(files, records), folder_, force);
  remove_tree(staging_);  // of a process that was killed
  make_directories(staging_);
}

ResultFiles::~ResultFiles() {
  std::error_code ignored;
  fs::remove_all(staging_, ignored);
}

void ResultFiles::commit(Provenance& provenance) const {
  provenance.outputs.clear();
  for (const fs::path& file : results_) {
    provenance.outputs.push_back(record_file(staged(file)));
    provenance.outputs.back().path = file.filename().string();
  }
  AtomicFile record(record_);
  record.write(provenance_json(provenance));  // all are written before the first is in its place
  for (const fs::path& file : results_) fs::rename(staged(file), file);
  record.commit();
}

}  // namespace clerestory
