// The folder of a run, with objects put in and a panorama, as insert, edit, replay and report read it. What its files
// say must come out of the report as text: an input that has the beginning of a tag finds it escaped there.
#include <exception>

#include "experiments/applications/render_record.hpp"
#include "experiments/applications/run_folder.hpp"
#include "experiments/applications/run_report.hpp"
#include "experiments/applications/run_results.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/report/own_files.hpp"
#include "tests/fuzz/folder.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
constexpr int width = 8, height = 6;
constexpr const char* kTag = "<zq";

Provenance record(const std::string& command, std::vector<FileRecord> outputs, const FileRecord& made_from) {
  Provenance provenance = begin_provenance({"clerestory", command});
  provenance.outputs = std::move(outputs), provenance.inputs = {made_from};
  return provenance;
}

void make(const fs::path& folder) {
  Scene scene;
  scene.camera = Camera::from_fov(width, height, 60);
  scene.photo = Image(width, height, 3, 0.5f), scene.albedo = Image(width, height, 3, 0.5f);
  scene.material = Image(width, height, 3), scene.depth = Image(width, height, 1, 2.0f);
  scene.normal = Image(width, height, 3);
  std::fill_n(scene.normal.plane(2), scene.normal.pixels(), 1.0f);
  write_run(folder, scene, Rerender{scene.photo, Image(width, height, 3, 0.1f), Image(width, height, 1, 0.1f)});
  RenderRecord rendered;
  rendered.rounds = {{4, 1}};
  rendered.settings.lamps = {{{0, 1, -1}, 0.1, {1, 1, 1}}};
  write_render_record(folder / kRenderRecord, rendered);
  write_file(folder / "plan.txt", "one kernel\n");
  const FileRecord photo = record_file(folder / "photo.exr");
  write_provenance(folder / kProvenanceName, record("invert", record_files_in(folder), photo));
  write_exr(folder / "composite.exr", scene.photo);
  write_exr(folder / "panorama.exr", Image(16, 8, 3, 1.0f));
  write_provenance(folder / kInsertRecord, record("insert", {record_file(folder / "composite.exr")}, photo));
  Provenance light = record("light", {record_file(folder / "panorama.exr")}, photo);
  light.facts[kPointFact] = "0, 0, -1";
  write_provenance(folder / "panorama.json", light);
}

const FuzzTarget target = folder_target("run", make, [](const fs::path& folder) {
  std::exception_ptr refused;
  const auto tried = [&](const auto& read) {  // what one of them refuses the next may take
    try {
      read();
    } catch (const Error&) {
      refused = std::current_exception();
    }
  };
  tried([&] { read_run(folder); }), tried([&] { read_rerender(folder); }), tried([&] { read_gbuffer(folder); });
  tried([&] { parse_render_record(folder / kRenderRecord); }), tried([&] { foreign_in(folder); });
  tried([&] {
    write_run_report(folder);
    if (read_file(folder / "report.html").find(kTag) != std::string::npos)
      throw std::logic_error("the report does not escape what it prints");
  });
  if (refused) std::rethrow_exception(refused);
});

}  // namespace
}  // namespace clerestory
