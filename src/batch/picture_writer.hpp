#pragma once

#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "batch/plan.hpp"
#include "image.hpp"
#include "map/png_text.hpp"
#include "render/renderer.hpp"

namespace clerestory {

/// A rendered picture on its way to its files.
struct FinishedPicture {
    const Job* job = nullptr;
    Rendered picture;
    std::vector<cl_uint> preview;  ///< empty where no output needs one
    Header header;                 ///< of the EXR outputs
    PngText text;                  ///< of the PNG outputs
};

/// Encodes and writes pictures in a thread of its own. At most one picture is being written and none waits: what a
/// killed process loses is the picture that it wrote and the one that it rendered.
class PictureWriter {
  public:
    /// Called in the writer's thread after each picture; `failure` is null where all its files stand.
    using Done = std::function<void(const FinishedPicture& picture, double seconds, std::exception_ptr failure)>;

    explicit PictureWriter(Done done);
    PictureWriter(const PictureWriter&) = delete;
    PictureWriter& operator=(const PictureWriter&) = delete;

    /// Waits until the last picture is written, then hands over.
    void write(FinishedPicture picture);
    /// Waits until everything is written.
    void finish();

  private:
    void run(const std::stop_token& stopping);

    Done done_;
    std::mutex mutex_;
    std::condition_variable_any changed_;
    std::optional<FinishedPicture> waiting_;
    bool busy_ = false;
    std::jthread thread_;  ///< last, so that it ends before what it uses
};

}  // namespace clerestory
