// A layer of the OpenCL loader for tests: it gives drivers that cannot share with OpenGL the extension cl_khr_gl_sharing,
// by copying through the texture, and is stricter than any real driver about how it is used.
//
// OpenCL sees the texture as it was at acquire, and OpenGL sees what was written only when somebody has waited for the
// release: who waits too little sees wrong pixels. Whatever the standard does not allow is a line in the file that
// GL_LAYER_LOG names. The layer has an OpenGL context of its own that shares objects with the application's, and makes it
// current for a moment in whichever thread calls.
//
//   GL_LAYER_LOG      file of mistakes, one a line; empty after a flawless run
//   GL_LAYER_DEVICE   a part of the platform's version text: the devices that drive OpenGL (else all)
//   GL_LAYER_ANSWER   "list": no device is named as the current one, only as one that could share; "none": none is
//                     named; "missing": the function that asks is missing
//   GL_LAYER_EVENTS   if set, cl_khr_gl_event is there too
#include "gl_layer_contexts.h"

// ---- Shared images, and the commands on them that nobody has waited for ----------------------------------------------

struct image {
  cl_mem memory;
  struct sharing *sharing;
  GLuint texture;
  size_t region[3];
  cl_mem_flags flags;
  int acquired, references;    // the application's references: the driver has some of its own
  void *before, *after;        // pixels, from OpenGL and for it
  struct image *rest;
};
static struct image *images;

enum kind { ACQUIRE, USE, RELEASE };
struct command {
  enum kind kind;
  struct image *image;
  cl_command_queue queue;
  cl_event event;
  struct command *rest;  // earlier ones
};
static struct command *commands;

static struct image *image_of(cl_mem memory) {
  struct image *each = images;
  while (each && each->memory != memory) each = each->rest;
  return each;
}

static int in_order(cl_command_queue queue) {
  cl_command_queue_properties properties = 0;
  next->clGetCommandQueueInfo(queue, CL_QUEUE_PROPERTIES, sizeof properties, &properties, NULL);
  return !(properties & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE);
}

// Whether what is put into the queue now runs after the command by the standard's rules, not by luck.
static int ordered(const struct command *earlier, cl_command_queue queue, cl_uint count, const cl_event *waits) {
  if (earlier->queue == queue && in_order(queue)) return 1;
  for (cl_uint each = 0; each < count; ++each)
    if (waits[each] == earlier->event) return 1;
  return 0;
}

static void remember(enum kind kind, struct image *image, cl_command_queue queue, cl_event event) {
  struct command *made = malloc(sizeof *made);
  next->clRetainEvent(event);
  *made = (struct command){kind, image, queue, event, commands};
  commands = made;
}

static int texture_is_there(const struct image *image) {
  struct before was = enter(image->sharing);
  int there = gl.IsTexture(image->texture);
  leave(image->sharing, was);
  return there;
}

static void show(const struct image *image) {
  struct before was = enter(image->sharing);
  if (gl.IsTexture(image->texture)) {
    gl.BindTexture(GL_TEXTURE_2D, image->texture);
    gl.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, image->region[0], image->region[1], GL_RGBA, GL_UNSIGNED_BYTE, image->after);
  } else mistake(0, "texture %u was deleted before its release was over", image->texture);
  leave(image->sharing, was);
}

// Somebody has waited: for all of a queue, or for events of these commands and so, in order, for those before them.
static void waited(cl_command_queue queue, cl_uint count, const cl_event *events) {
  cl_command_queue reached[8] = {queue};
  int reached_count = 1;
  pthread_mutex_lock(&lock);
  for (struct command **link = &commands; *link;) {
    struct command *each = *link;
    int done = 0;
    for (int one = 0; one < reached_count; ++one) done |= each->queue == reached[one];
    for (cl_uint event = 0; event < count && !done; ++event) {
      done = events[event] == each->event;
      if (done && in_order(each->queue) && reached_count < 8) reached[reached_count++] = each->queue;
    }
    if (!done) {
      link = &each->rest;
      continue;
    }
    if (each->kind == RELEASE) show(each->image);
    *link = each->rest;
    next->clReleaseEvent(each->event);
    free(each);
  }
  pthread_mutex_unlock(&lock);
}

// A command that reads or writes an image, if it is one of ours: may it?
static cl_int check_use(struct image *image, cl_command_queue queue, cl_uint count, const cl_event *waits, const char *what) {
  if (!image->acquired) return mistake(CL_INVALID_OPERATION, "%s uses texture %u, which was not acquired", what, image->texture);
  for (struct command *each = commands; each; each = each->rest)
    if (each->image == image && each->kind == ACQUIRE && !ordered(each, queue, count, waits))
      return mistake(CL_INVALID_OPERATION, "%s uses texture %u before it is acquired", what, image->texture);
  return CL_SUCCESS;
}

static cl_mem refuse(cl_int *error, cl_int status) {
  if (error) *error = status;
  return NULL;
}

static cl_mem API create_from_texture(cl_context context, cl_mem_flags flags, cl_GLenum target, cl_GLint level, cl_GLuint texture,
                                      cl_int *error) {
  struct sharing *sharing = sharings;
  while (sharing && sharing->context != context) sharing = sharing->rest;
  if (!sharing) return refuse(error, mistake(CL_INVALID_CONTEXT, "the context of the image does not share with OpenGL"));
  if (target != GL_TEXTURE_2D) return refuse(error, mistake(CL_INVALID_VALUE, "target 0x%x is not GL_TEXTURE_2D", target));
  if (level != 0) return refuse(error, mistake(CL_INVALID_MIP_LEVEL, "level %d of the texture is not 0", level));
  if (flags != CL_MEM_WRITE_ONLY && flags != CL_MEM_READ_ONLY && flags != CL_MEM_READ_WRITE)
    return refuse(error, mistake(CL_INVALID_VALUE, "flags 0x%lx of the image", (long)flags));
  GLint width = 0, height = 0, format = 0, filter = 0, levels = 0;
  struct before was = enter(sharing);
  int there = gl.IsTexture(texture);
  if (there) {
    gl.BindTexture(GL_TEXTURE_2D, texture);
    gl.GetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_WIDTH, &width);
    gl.GetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_HEIGHT, &height);
    gl.GetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_INTERNAL_FORMAT, &format);
    gl.GetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, &filter);
    gl.GetTexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, &levels);
  }
  leave(sharing, was);
  if (!there) return refuse(error, mistake(CL_INVALID_GL_OBJECT, "there is no texture %u", texture));
  if (!width || !height) return refuse(error, mistake(CL_INVALID_GL_OBJECT, "texture %u has no pixels", texture));
  if (filter > GL_LINEAR && levels > 0)
    return refuse(error, mistake(CL_INVALID_GL_OBJECT, "texture %u is not complete: its mipmaps are missing", texture));
  if (format != GL_RGBA8)
    return refuse(error, mistake(CL_INVALID_IMAGE_FORMAT_DESCRIPTOR, "texture %u has the format 0x%x, not GL_RGBA8",
                                 texture, format));
  const cl_image_format rgba8 = {CL_RGBA, CL_UNORM_INT8};
  const cl_image_desc size = {.image_type = CL_MEM_OBJECT_IMAGE2D, .image_width = width, .image_height = height};
  cl_mem memory = next->clCreateImage(context, flags, &rgba8, &size, NULL, error);
  if (!memory) return NULL;
  struct image *made = calloc(1, sizeof *made);
  pthread_mutex_lock(&lock);
  *made = (struct image){memory, sharing, texture, {width, height, 1}, flags, 0, 1, malloc(4 * width * height),
                         malloc(4 * width * height), images};
  images = made;
  pthread_mutex_unlock(&lock);
  return memory;
}

static cl_int check_objects(cl_command_queue queue, cl_uint count, const cl_mem *objects) {
  cl_context context = NULL;
  next->clGetCommandQueueInfo(queue, CL_QUEUE_CONTEXT, sizeof context, &context, NULL);
  if (!count || !objects) return mistake(CL_INVALID_VALUE, "no objects to acquire or release");
  for (cl_uint each = 0; each < count; ++each) {
    struct image *image = image_of(objects[each]);
    if (!image) return mistake(CL_INVALID_GL_OBJECT, "an object to acquire or release was not made from a texture");
    if (image->sharing->context != context) return mistake(CL_INVALID_CONTEXT, "texture %u is another context's", image->texture);
    if (!texture_is_there(image)) return mistake(CL_INVALID_GL_OBJECT, "texture %u was deleted while it is shared", image->texture);
  }
  return CL_SUCCESS;
}

static cl_event unused_fence;

static cl_int acquire_one(struct image *image, cl_command_queue queue, cl_uint count, const cl_event *waits, cl_event *event) {
  const size_t origin[3] = {0, 0, 0};
  if (image->acquired) return mistake(CL_INVALID_OPERATION, "texture %u was acquired twice", image->texture);
  for (struct command *each = commands; each; each = each->rest)
    if (each->image == image && each->kind == RELEASE)
      return mistake(CL_INVALID_OPERATION, "texture %u was acquired again before anybody waited for its release", image->texture);
  for (cl_uint each = 0; each < count; ++each)
    if (waits[each] == unused_fence) unused_fence = NULL;
  if (unused_fence) return mistake(CL_INVALID_OPERATION, "texture %u is acquired without waiting for the fence", image->texture);
  struct before was = enter(image->sharing);
  gl.BindTexture(GL_TEXTURE_2D, image->texture);
  gl.GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_UNSIGNED_BYTE, image->before);
  leave(image->sharing, was);
  cl_int status = next->clEnqueueWriteImage(queue, image->memory, CL_FALSE, origin, image->region, 0, 0, image->before, count,
                                            waits, event);
  if (status) return status;
  image->acquired = 1;
  remember(ACQUIRE, image, queue, *event);
  return CL_SUCCESS;
}

static cl_int release_one(struct image *image, cl_command_queue queue, cl_uint count, const cl_event *waits, cl_event *event) {
  const size_t origin[3] = {0, 0, 0};
  if (!image->acquired) return mistake(CL_INVALID_OPERATION, "texture %u was released without an acquire", image->texture);
  for (struct command *each = commands; each; each = each->rest)
    if (each->image == image && !ordered(each, queue, count, waits))
      mistake(0, "texture %u was released before what uses it has ended", image->texture);
  cl_int status = next->clEnqueueReadImage(queue, image->memory, CL_FALSE, origin, image->region, 0, 0, image->after, count,
                                           waits, event);
  if (status) return status;
  image->acquired = 0;
  remember(RELEASE, image, queue, *event);
  return CL_SUCCESS;
}

typedef cl_int change(struct image *, cl_command_queue, cl_uint, const cl_event *, cl_event *);

static cl_int for_each(change *changed, cl_command_queue queue, cl_uint count, const cl_mem *objects, cl_uint wait_count,
                       const cl_event *waits, cl_event *event) {
  pthread_mutex_lock(&lock);
  cl_int status = check_objects(queue, count, objects);
  for (cl_uint each = 0; !status && each < count; ++each) {
    cl_event made = NULL;
    status = changed(image_of(objects[each]), queue, wait_count, waits, &made);
    if (!status && event && each == count - 1) *event = made;
    else if (!status) next->clReleaseEvent(made);
  }
  pthread_mutex_unlock(&lock);
  return status;
}

static cl_int API acquire(cl_command_queue queue, cl_uint count, const cl_mem *objects, cl_uint wait_count, const cl_event *waits,
                          cl_event *event) {
  return for_each(acquire_one, queue, count, objects, wait_count, waits, event);
}

static cl_int API release(cl_command_queue queue, cl_uint count, const cl_mem *objects, cl_uint wait_count, const cl_event *waits,
                          cl_event *event) {
  return for_each(release_one, queue, count, objects, wait_count, waits, event);
}

static cl_int API retain_memory(cl_mem memory) {
  pthread_mutex_lock(&lock);
  if (image_of(memory)) ++image_of(memory)->references;
  pthread_mutex_unlock(&lock);
  return next->clRetainMemObject(memory);
}

static cl_int API release_memory(cl_mem memory) {
  pthread_mutex_lock(&lock);
  struct image **link = &images, *image;
  while (*link && (*link)->memory != memory) link = &(*link)->rest;
  if ((image = *link) && !--image->references) {
    if (image->acquired) mistake(0, "the image of texture %u was given up while it was acquired", image->texture);
    if (!texture_is_there(image)) mistake(0, "texture %u was deleted before its image", image->texture);
    int busy = 0;
    for (struct command *each = commands; each; each = each->rest) busy |= each->image == image;
    if (busy) mistake(0, "the image of texture %u was given up while commands use it", image->texture);
    *link = image->rest;  // what it holds is left to commands that may still run
  }
  pthread_mutex_unlock(&lock);
  return next->clReleaseMemObject(memory);
}

__attribute__((destructor)) static void at_exit(void) {
  for (struct image *each = images; each; each = each->rest)
    mistake(0, "the image of texture %u was never given up", each->texture);
  for (struct command *each = commands; each; each = each->rest)
    if (each->kind == RELEASE) mistake(0, "nobody ever waited for the release of texture %u", each->image->texture);
}

// ---- Who uses the images ---------------------------------------------------------------------------------------------

struct argument {
  cl_kernel kernel;
  cl_uint index;
  cl_mem memory;
  struct argument *rest;
};
static struct argument *arguments;

static void forget(cl_kernel kernel, const cl_uint *index) {
  for (struct argument **link = &arguments; *link;) {
    struct argument *each = *link;
    if (each->kernel == kernel && (!index || each->index == *index)) *link = each->rest, free(each);
    else link = &each->rest;
  }
}

static cl_int API set_argument(cl_kernel kernel, cl_uint index, size_t size, const void *value) {
  pthread_mutex_lock(&lock);
  forget(kernel, &index);
  struct image *image = size == sizeof(cl_mem) && value ? image_of(*(const cl_mem *)value) : NULL;
  if (image) {
    struct argument *made = malloc(sizeof *made);
    *made = (struct argument){kernel, index, image->memory, arguments};
    arguments = made;
    cl_kernel_arg_access_qualifier access = CL_KERNEL_ARG_ACCESS_NONE;
    next->clGetKernelArgInfo(kernel, index, CL_KERNEL_ARG_ACCESS_QUALIFIER, sizeof access, &access, NULL);
    if ((access == CL_KERNEL_ARG_ACCESS_WRITE_ONLY && image->flags == CL_MEM_READ_ONLY) ||
        (access == CL_KERNEL_ARG_ACCESS_READ_ONLY && image->flags == CL_MEM_WRITE_ONLY) ||
        (access == CL_KERNEL_ARG_ACCESS_READ_WRITE && image->flags != CL_MEM_READ_WRITE))
      mistake(0, "flags 0x%lx of texture %u do not allow what the kernel does", (long)image->flags, image->texture);
  }
  pthread_mutex_unlock(&lock);
  return next->clSetKernelArg(kernel, index, size, value);
}

// Else compilers do not tell whether a kernel reads or writes an image.
static cl_int API build(cl_program program, cl_uint count, const cl_device_id *devices, const char *options,
                        void(CL_CALLBACK *notify)(cl_program, void *), void *data) {
  char more[16384];
  snprintf(more, sizeof more, "%s -cl-kernel-arg-info", options ? options : "");
  return next->clBuildProgram(program, count, devices, more, notify, data);
}

static cl_int API release_kernel(cl_kernel kernel) {
  cl_uint count = 0;
  next->clGetKernelInfo(kernel, CL_KERNEL_REFERENCE_COUNT, sizeof count, &count, NULL);
  pthread_mutex_lock(&lock);
  if (count == 1) forget(kernel, NULL);
  pthread_mutex_unlock(&lock);
  return next->clReleaseKernel(kernel);
}

static cl_int API run_kernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions, const size_t *offset,
                             const size_t *global, const size_t *local, cl_uint count, const cl_event *waits, cl_event *event) {
  cl_int status = CL_SUCCESS;
  cl_event made = NULL;
  pthread_mutex_lock(&lock);
  for (struct argument *each = arguments; each && !status; each = each->rest)
    if (each->kernel == kernel && image_of(each->memory))
      status = check_use(image_of(each->memory), queue, count, waits, "a kernel");
  if (!status) status = next->clEnqueueNDRangeKernel(queue, kernel, dimensions, offset, global, local, count, waits, &made);
  for (struct argument *each = arguments; each && !status; each = each->rest)
    if (each->kernel == kernel && image_of(each->memory)) remember(USE, image_of(each->memory), queue, made);
  pthread_mutex_unlock(&lock);
  if (!status && event) *event = made;
  else if (!status) next->clReleaseEvent(made);
  return status;
}

// The other commands on images: parameters in `P`, arguments in `A`, the last ones of which are the wait list.
#define USES(function, image_, P, ...)                                                                    \
  static cl_int API use_##function P {                                                                    \
    pthread_mutex_lock(&lock);                                                                            \
    struct image *image = image_of(image_);                                                               \
    cl_event made = NULL;                                                                                 \
    cl_int status = image ? check_use(image, queue, count, waits, #function) : CL_SUCCESS;                \
    if (!status) status = next->function(__VA_ARGS__, count, waits, &made);                               \
    if (!status && image) remember(USE, image, queue, made);                                              \
    pthread_mutex_unlock(&lock);                                                                          \
    if (!status && event) *event = made;                                                                  \
    else if (!status) next->clReleaseEvent(made);                                                         \
    return status;                                                                                        \
  }
#define WAITS cl_uint count, const cl_event *waits, cl_event *event
USES(clEnqueueCopyBufferToImage, to, (cl_command_queue queue, cl_mem from, cl_mem to, size_t o, const size_t *p,
     const size_t *r, WAITS),
     queue, from, to, o, p, r)
USES(clEnqueueCopyImageToBuffer, from, (cl_command_queue queue, cl_mem from, cl_mem to, const size_t *p,
     const size_t *r, size_t o, WAITS),
     queue, from, to, p, r, o)
USES(clEnqueueReadImage, from, (cl_command_queue queue, cl_mem from, cl_bool b, const size_t *p, const size_t *r,
     size_t i, size_t j, void *v, WAITS),
     queue, from, b, p, r, i, j, v)
USES(clEnqueueWriteImage, to, (cl_command_queue queue, cl_mem to, cl_bool b, const size_t *p, const size_t *r,
     size_t i, size_t j, const void *v, WAITS),
     queue, to, b, p, r, i, j, v)
USES(clEnqueueFillImage, to, (cl_command_queue queue, cl_mem to, const void *color, const size_t *p, const size_t *r, WAITS),
     queue, to, color, p, r)

static cl_int API finish(cl_command_queue queue) {
  cl_int status = next->clFinish(queue);
  waited(queue, 0, NULL);
  return status;
}

static cl_int API wait_for(cl_uint count, const cl_event *events) {
  cl_int status = next->clWaitForEvents(count, events);
  waited(NULL, count, events);
  return status;
}

// A fence of OpenGL's: waited for at once, which any driver may do.
static cl_event API event_from_fence(cl_context context, cl_GLsync fence, cl_int *error) {
  struct sharing *sharing = sharings;
  while (sharing && sharing->context != context) sharing = sharing->rest;
  cl_int status = sharing ? CL_SUCCESS : mistake(CL_INVALID_CONTEXT, "the context of the fence does not share with OpenGL");
  if (!status) {
    struct before was = enter(sharing);
    if (!gl.IsSync(fence)) status = mistake(CL_INVALID_GL_OBJECT, "there is no such fence");
    else {
      GLenum state = gl.ClientWaitSync(fence, 0, 500000000ull);
      if (state == GL_TIMEOUT_EXPIRED || state == GL_WAIT_FAILED)
        status = mistake(CL_INVALID_GL_OBJECT, "the fence was not flushed");
    }
    leave(sharing, was);
  }
  cl_event made = status ? NULL : next->clCreateUserEvent(context, &status);
  if (made) next->clSetUserEventStatus(made, CL_COMPLETE);
  unused_fence = made;
  if (error) *error = status;
  return made;
}

// ---- What the loader asks of a layer ---------------------------------------------------------------------------------

static cl_int API device_info(cl_device_id device, cl_device_info name, size_t size, void *value, size_t *needed) {
  char text[16384];
  size_t length;
  if (name != CL_DEVICE_EXTENSIONS) return next->clGetDeviceInfo(device, name, size, value, needed);
  cl_int status = next->clGetDeviceInfo(device, name, sizeof text - 64, text, &length);
  if (status) return status;
  strcat(text, " cl_khr_gl_sharing");
  if (getenv("GL_LAYER_EVENTS")) strcat(text, " cl_khr_gl_event");
  length = strlen(text) + 1;
  if (needed) *needed = length;
  if (value && size < length) return CL_INVALID_VALUE;
  if (value) memcpy(value, text, length);
  return CL_SUCCESS;
}

static void *API extension(cl_platform_id platform, const char *name) {
  const char *answer = getenv("GL_LAYER_ANSWER");
  if (!strcmp(name, "clGetGLContextInfoKHR")) return answer && !strcmp(answer, "missing") ? NULL : (void *)gl_context_info;
  if (!strcmp(name, "clCreateEventFromGLsyncKHR")) return getenv("GL_LAYER_EVENTS") ? (void *)event_from_fence : NULL;
  return next->clGetExtensionFunctionAddressForPlatform(platform, name);
}

CL_API_ENTRY cl_int API clGetLayerInfo(cl_layer_info name, size_t size, void *value, size_t *needed) {
  if (name != CL_LAYER_API_VERSION || (value && size < sizeof(cl_layer_api_version))) return CL_INVALID_VALUE;
  if (value) *(cl_layer_api_version *)value = CL_LAYER_API_VERSION_100;
  if (needed) *needed = sizeof(cl_layer_api_version);
  return CL_SUCCESS;
}

CL_API_ENTRY cl_int API clInitLayer(cl_uint count, const struct _cl_icd_dispatch *target, cl_uint *returned,
                                    const struct _cl_icd_dispatch **layer) {
  static struct _cl_icd_dispatch ours;
  if (count < sizeof ours / sizeof(void *)) return CL_INVALID_VALUE;
  next = target;
  ours.clGetDeviceInfo = device_info, ours.clCreateContext = create_context, ours.clSetKernelArg = set_argument;
  ours.clGetGLContextInfoKHR = gl_context_info, ours.clCreateEventFromGLsyncKHR = event_from_fence;
  ours.clGetExtensionFunctionAddressForPlatform = extension, ours.clCreateFromGLTexture = create_from_texture;
  ours.clCreateFromGLTexture2D = create_from_texture;  // pyopencl calls the older one
  ours.clEnqueueAcquireGLObjects = acquire, ours.clEnqueueReleaseGLObjects = release;
  ours.clBuildProgram = build, ours.clRetainMemObject = retain_memory;
  ours.clReleaseMemObject = release_memory, ours.clReleaseKernel = release_kernel;
  ours.clEnqueueNDRangeKernel = run_kernel, ours.clFinish = finish, ours.clWaitForEvents = wait_for;
  ours.clEnqueueCopyBufferToImage = use_clEnqueueCopyBufferToImage, ours.clEnqueueFillImage = use_clEnqueueFillImage;
  ours.clEnqueueCopyImageToBuffer = use_clEnqueueCopyImageToBuffer, ours.clEnqueueReadImage = use_clEnqueueReadImage;
  ours.clEnqueueWriteImage = use_clEnqueueWriteImage;
  *returned = sizeof ours / sizeof(void *), *layer = &ours;
  return CL_SUCCESS;
}
