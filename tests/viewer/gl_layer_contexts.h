// Contexts of the layer of gl_layer.c: the properties that make one share with OpenGL, and the devices that drive OpenGL.
#include "gl_layer_opengl.h"

static int drives_gl(cl_device_id device) {
  const char *wanted = getenv("GL_LAYER_DEVICE");
  char version[512] = "";
  cl_platform_id platform = NULL;
  next->clGetDeviceInfo(device, CL_DEVICE_PLATFORM, sizeof platform, &platform, NULL);
  next->clGetPlatformInfo(platform, CL_PLATFORM_VERSION, sizeof version, version, NULL);
  return !wanted || strstr(version, wanted) != NULL;
}

// What the properties say of OpenGL: 1 if anything; `status` is an error if it is not the context current in this thread.
static int read_properties(const cl_context_properties *list, struct sharing *found, cl_platform_id *platform, cl_int *status) {
  int there = 0;
  memset(found, 0, sizeof *found);
  *status = CL_SUCCESS, *platform = NULL;
  for (; list && list[0]; list += 2) {
    void *value = (void *)list[1];
    if (list[0] == CL_CONTEXT_PLATFORM) *platform = value;
    else if (list[0] == CL_GL_CONTEXT_KHR) there = 1, found->theirs = value;
    else if (list[0] == CL_GLX_DISPLAY_KHR) there = 1, found->display = value;
    else if (list[0] == CL_EGL_DISPLAY_KHR) there = 1, found->is_egl = 1, found->display = value;
    else if (list[0] != CL_CONTEXT_INTEROP_USER_SYNC)
      *status = mistake(-64, "property 0x%lx is not known", (long)list[0]);
  }
  if (!there || *status) return there;
  find_platforms();
  void *glx_context = glx.GetCurrentContext ? glx.GetCurrentContext() : NULL;
  void *egl_context = egl.GetCurrentContext ? egl.GetCurrentContext() : NULL;
  void *context = glx_context ? glx_context : egl_context;
  if (!context) *status = mistake(-1000, "OpenGL's context is not current in the thread that asks");
  else if (!found->theirs) *status = mistake(-1000, "property CL_GL_CONTEXT_KHR is missing");
  else if (found->theirs != context) *status = mistake(-1000, "property CL_GL_CONTEXT_KHR is not the current context");
  else if (!found->display) *status = mistake(-1000, "the property of the display is missing");
  else if (found->is_egl != !glx_context) *status = mistake(-1000, "the property of the display is another platform's");
  else if (found->display != (glx_context ? glx.GetCurrentDisplay() : egl.GetCurrentDisplay()))
    *status = mistake(-1000, "the property of the display is not the current display");
  return there;
}

static cl_int API gl_context_info(const cl_context_properties *properties, cl_gl_context_info name, size_t size, void *value,
                                  size_t *needed) {
  const char *answer = getenv("GL_LAYER_ANSWER");
  struct sharing asked;
  cl_platform_id platform;
  cl_int status;
  cl_device_id device = NULL;
  if (!read_properties(properties, &asked, &platform, &status)) return mistake(-1000, "asked for devices of no OpenGL context");
  if (status) return status;
  if (!platform) return mistake(CL_INVALID_PLATFORM, "asked for devices without a platform");
  next->clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 1, &device, NULL);
  int named = device && drives_gl(device) && (name == CL_DEVICES_FOR_GL_CONTEXT_KHR || !answer);
  if (answer && !strcmp(answer, "none")) named = 0;
  if (needed) *needed = named ? sizeof device : 0;
  if (named && value && size < sizeof device) return CL_INVALID_VALUE;
  if (named && value) *(cl_device_id *)value = device;
  return CL_SUCCESS;
}

static cl_context API create_context(const cl_context_properties *properties, cl_uint count, const cl_device_id *devices,
                                     void(CL_CALLBACK *notify)(const char *, const void *, size_t, void *), void *data,
                                     cl_int *error) {
  struct sharing asked;
  cl_platform_id platform;
  cl_int status;
  int shared = read_properties(properties, &asked, &platform, &status);
  for (cl_uint each = 0; shared && !status && each < count; ++each)
    if (!drives_gl(devices[each])) status = mistake(CL_INVALID_OPERATION, "a device of the context does not drive OpenGL");
  if (shared && !status && !make_ours(&asked)) status = mistake(-1000, "the layer's own OpenGL context cannot be made");
  if (status) {
    if (error) *error = status;
    return NULL;
  }
  const cl_context_properties rest[] = {CL_CONTEXT_PLATFORM, (cl_context_properties)platform, 0};
  cl_context made = next->clCreateContext(shared ? (platform ? rest : NULL) : properties, count, devices, notify, data, error);
  if (made && shared) {
    struct sharing *kept = malloc(sizeof *kept);
    *kept = asked, kept->context = made;
    pthread_mutex_lock(&lock);
    kept->rest = sharings, sharings = kept;
    pthread_mutex_unlock(&lock);
  }
  return made;
}
