<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="zh_CN" sourcelanguage="en">
<context>
    <name>About</name>
    <message>
        <source>About Lightpen</source>
        <translation>关于 Lightpen</translation>
    </message>
    <message>
        <source>Calibrates the probe tip of a light pen.</source>
        <translation>校准光笔的测头。</translation>
    </message>
    <message>
        <source>Lightpen: MIT licence. Qt and PySide6: LGPL 3. Fonts: cut from Noto Sans and Noto Sans CJK, SIL Open Font License 1.1.</source>
        <translation>Lightpen：MIT 许可证。Qt 和 PySide6：LGPL 3。字体：截取自 Noto Sans 和 Noto Sans CJK，SIL 开放字体许可证 1.1。</translation>
    </message>
</context>
<context>
    <name>ActionBar</name>
    <message>
        <source>Back</source>
        <translation>返回</translation>
    </message>
</context>
<context>
    <name>CameraPage</name>
    <message>
        <source>Camera</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>See that the LEDs are bright and sharp, that the intrinsics are those of this camera, and that nothing else shines.</source>
        <translation>确认 LED 明亮清晰，内参属于这台相机，并且没有其他光源。</translation>
    </message>
    <message>
        <source>The camera is lost. It is looked for until it is back.</source>
        <translation>相机连接中断。程序会持续查找，直到恢复。</translation>
    </message>
    <message>
        <source>Continue to the LEDs</source>
        <translation>继续：LED</translation>
    </message>
    <message>
        <source>No camera is open.</source>
        <translation>相机未打开。</translation>
    </message>
    <message>
        <source>stray</source>
        <translation>杂散光</translation>
    </message>
    <message>
        <source>A swing is under way. Another source ends it; other intrinsics and another mask count from the next swing on.</source>
        <translation>摆动正在进行。更换来源会结束摆动；新的内参和屏蔽从下一次摆动起生效。</translation>
    </message>
</context>
<context>
    <name>Demo</name>
    <message>
        <source>The demo ends here: there is no tip to accept.</source>
        <translation>演示到此结束：没有可接受的测头结果。</translation>
    </message>
    <message>
        <source>Demo: station, pen, tip and cone are named.</source>
        <translation>演示：填写工位、光笔、测头和锥孔。</translation>
    </message>
    <message>
        <source>Demo: the simulated camera sends images; exposure, focus and the intrinsics are checked.</source>
        <translation>演示：模拟相机送来图像；检查曝光、对焦和内参。</translation>
    </message>
    <message>
        <source>Demo: the LEDs of the file are compared with those in the image.</source>
        <translation>演示：将文件中的 LED 与图像中的 LED 比较。</translation>
    </message>
    <message>
        <source>Demo: the simulated operator seats the tip and follows the arrow. No key is pressed from here to the verdict.</source>
        <translation>演示：模拟操作员将测头就位并跟随箭头。从这里到得出结论，无需按任何键。</translation>
    </message>
    <message>
        <source>Demo: the tip, what it is worth, and why.</source>
        <translation>演示：测头结果、可信程度及其依据。</translation>
    </message>
    <message>
        <source>That was the demo. Look around as long as you like; nothing of it is kept. Start the program without the demo to calibrate a tip.</source>
        <translation>演示结束。您可以随意查看；演示数据不会保留。要校准测头，请不带演示启动程序。</translation>
    </message>
</context>
<context>
    <name>ExposureBar</name>
    <message>
        <source>Exposure of the LEDs</source>
        <translation>LED 曝光</translation>
    </message>
    <message>
        <source>No LED is seen</source>
        <translation>看不到 LED</translation>
    </message>
    <message>
        <source>Saturated: {0} of {1} LEDs</source>
        <translation>饱和：{1} 个 LED 中有 {0} 个</translation>
    </message>
    <message>
        <source>Saturated: {0} of {1} spots</source>
        <translation>饱和：{1} 个光点中有 {0} 个</translation>
    </message>
    <message>
        <source>Too dark: {0} of {1} LEDs</source>
        <translation>过暗：{1} 个 LED 中有 {0} 个</translation>
    </message>
    <message>
        <source>Too dark: {0} of {1} spots</source>
        <translation>过暗：{1} 个光点中有 {0} 个</translation>
    </message>
    <message>
        <source>Good: {0} LEDs</source>
        <translation>合适：{0} 个 LED</translation>
    </message>
    <message>
        <source>Good: {0} spots</source>
        <translation>合适：{0} 个光点</translation>
    </message>
    <message>
        <source>dark</source>
        <translation>过暗</translation>
    </message>
    <message>
        <source>good</source>
        <translation>合适</translation>
    </message>
    <message>
        <source>saturated</source>
        <translation>饱和</translation>
    </message>
</context>
<context>
    <name>ExposurePanel</name>
    <message>
        <source>E&amp;xposure</source>
        <translation>曝光(&amp;X)</translation>
    </message>
    <message>
        <source>Exposure</source>
        <translation>曝光</translation>
    </message>
    <message>
        <source>&amp;Gain</source>
        <translation>增益(&amp;G)</translation>
    </message>
    <message>
        <source>Gain</source>
        <translation>增益</translation>
    </message>
    <message>
        <source>Up and Down change it; Enter takes a typed number.</source>
        <translation>用上下键调整；输入数值后按 Enter。</translation>
    </message>
    <message>
        <source>No images come.</source>
        <translation>没有图像。</translation>
    </message>
    <message>
        <source>Recorded: exposure and gain are as they were taken.</source>
        <translation>录制的图像：曝光和增益为拍摄时的值。</translation>
    </message>
    <message>
        <source>Hold the pen so that the camera sees its LEDs.</source>
        <translation>握住光笔，使相机能看到 LED。</translation>
    </message>
    <message>
        <source>All lie in the good part of the scale.</source>
        <translation>全部位于“合适”区间。</translation>
    </message>
    <message>
        <source>Lower the gain until no LED is saturated.</source>
        <translation>降低增益，直到没有 LED 饱和。</translation>
    </message>
    <message>
        <source>Shorten the exposure until no LED is saturated.</source>
        <translation>缩短曝光，直到没有 LED 饱和。</translation>
    </message>
    <message>
        <source>Lengthen the exposure until all LEDs are good.</source>
        <translation>延长曝光，直到所有 LED 都合适。</translation>
    </message>
    <message>
        <source>Raise the gain: a longer exposure would smear the moving pen.</source>
        <translation>提高增益：再延长曝光会使移动的光笔拖影。</translation>
    </message>
    <message>
        <source>The LEDs differ too much in brightness. Clean them, and check their supply.</source>
        <translation>各 LED 亮度相差太大。请清洁 LED，并检查供电。</translation>
    </message>
    <message>
        <source>Take the images again with a shorter exposure.</source>
        <translation>请用更短的曝光重新拍摄。</translation>
    </message>
    <message>
        <source>Take the images again with a longer exposure.</source>
        <translation>请用更长的曝光重新拍摄。</translation>
    </message>
    <message>
        <source>Close the aperture of the lens a little.</source>
        <translation>把镜头光圈调小一点。</translation>
    </message>
    <message>
        <source>Open the aperture of the lens a little.</source>
        <translation>把镜头光圈调大一点。</translation>
    </message>
</context>
<context>
    <name>FocusMeter</name>
    <message>
        <source>No LED is seen</source>
        <translation>看不到 LED</translation>
    </message>
    <message>
        <source>Sharp</source>
        <translation>清晰</translation>
    </message>
    <message>
        <source>Soft</source>
        <translation>模糊</translation>
    </message>
    <message>
        <source>{0} px</source>
        <translation>{0} px</translation>
    </message>
    <message>
        <source>limit {0}</source>
        <translation>限值 {0}</translation>
    </message>
    <message>
        <source>Width of the LEDs&apos; rims</source>
        <translation>LED 边缘宽度</translation>
    </message>
</context>
<context>
    <name>FocusPanel</name>
    <message>
        <source>Turn the focus ring until the rims are narrowest.</source>
        <translation>转动对焦环，使边缘最窄。</translation>
    </message>
    <message>
        <source>Width of the LEDs&apos; rims from dark to bright. Hold the pen still.</source>
        <translation>LED 边缘由暗到亮的宽度。请保持光笔不动。</translation>
    </message>
</context>
<context>
    <name>FramePanel</name>
    <message>
        <source>Pen and its frame</source>
        <translation>光笔及其坐标系</translation>
    </message>
    <message>
        <source>Put into the pen frame</source>
        <translation>转换到光笔坐标系</translation>
    </message>
    <message>
        <source>These are coordinates in another frame, such as a measuring machine&apos;s.</source>
        <translation>这些坐标属于其他坐标系，例如测量机坐标系。</translation>
    </message>
    <message>
        <source>Not the layout of the ten-LED pen: the frame of the file is taken as it is.</source>
        <translation>不是十 LED 光笔的布局：直接采用文件的坐标系。</translation>
    </message>
    <message>
        <source>fulfilled</source>
        <translation>满足</translation>
    </message>
    <message>
        <source>not fulfilled</source>
        <translation>不满足</translation>
    </message>
    <message>
        <source>LEDs well apart</source>
        <translation>LED 间距足够</translation>
    </message>
    <message>
        <source>Numbers in order</source>
        <translation>编号顺序正确</translation>
    </message>
    <message>
        <source>LEDs 1 to 4 in a line</source>
        <translation>LED 1 至 4 共线</translation>
    </message>
    <message>
        <source>LED 1 over the origin</source>
        <translation>LED 1 位于原点上方</translation>
    </message>
    <message>
        <source>y along LEDs 1 to 4</source>
        <translation>y 轴沿 LED 1 至 4</translation>
    </message>
    <message>
        <source>LEDs 5 to 10 at z = 0</source>
        <translation>LED 5 至 10 位于 z = 0</translation>
    </message>
    <message>
        <source>Axes right-handed</source>
        <translation>右手坐标系</translation>
    </message>
    <message>
        <source>Discs face the viewer</source>
        <translation>发光面朝向观察者</translation>
    </message>
</context>
<context>
    <name>HandPanel</name>
    <message>
        <source>Simulated pen</source>
        <translation>模拟光笔</translation>
    </message>
    <message>
        <source>Let the simulated operator swing</source>
        <translation>让模拟操作员摆动</translation>
    </message>
    <message>
        <source>It seats the tip and follows the arrow by itself.</source>
        <translation>自动将测头就位并跟随箭头。</translation>
    </message>
    <message>
        <source>Seat</source>
        <translation>就位</translation>
    </message>
    <message>
        <source>Put the tip into the cone; then drag the dot of the dial.</source>
        <translation>把测头放入锥孔；然后拖动姿态盘上的圆点。</translation>
    </message>
    <message>
        <source>Swing</source>
        <translation>摆动</translation>
    </message>
    <message>
        <source>Swing the pen round the cone, whatever the arrow says.</source>
        <translation>绕锥孔摆动光笔，不理会箭头。</translation>
    </message>
    <message>
        <source>Hold</source>
        <translation>保持</translation>
    </message>
    <message>
        <source>Hold the pen still as it is.</source>
        <translation>保持光笔现在的姿态不动。</translation>
    </message>
    <message>
        <source>Lift</source>
        <translation>抬起</translation>
    </message>
    <message>
        <source>Take the tip out of the cone.</source>
        <translation>把测头从锥孔中抬起。</translation>
    </message>
    <message>
        <source>Leave</source>
        <translation>离开</translation>
    </message>
    <message>
        <source>Take the pen out of the image.</source>
        <translation>把光笔移出图像。</translation>
    </message>
    <message>
        <source>Slip</source>
        <translation>滑动</translation>
    </message>
    <message>
        <source>Let the tip slip by {0} mm for a moment.</source>
        <translation>让测头短暂滑动 {0} mm。</translation>
    </message>
    <message>
        <source>Cover</source>
        <translation>遮挡</translation>
    </message>
    <message>
        <source>Hold a hand before the LEDs for a moment.</source>
        <translation>用手短暂挡住 LED。</translation>
    </message>
</context>
<context>
    <name>HelpWindow</name>
    <message>
        <source>Help</source>
        <translation>帮助</translation>
    </message>
</context>
<context>
    <name>ImageModel</name>
    <message>
        <source>Image</source>
        <translation>图像</translation>
    </message>
    <message>
        <source>Misfit / px</source>
        <translation>误差 / px</translation>
    </message>
    <message>
        <source>LEDs</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>State</source>
        <translation>状态</translation>
    </message>
    <message>
        <source>used</source>
        <translation>已使用</translation>
    </message>
</context>
<context>
    <name>ImageTable</name>
    <message>
        <source>Images, the worst first</source>
        <translation>图像，最差的在前</translation>
    </message>
</context>
<context>
    <name>ImageView</name>
    <message>
        <source>Live image</source>
        <translation>实时图像</translation>
    </message>
</context>
<context>
    <name>ImagesPanel</name>
    <message>
        <source>Take out</source>
        <translation>剔除</translation>
    </message>
    <message>
        <source>Put back</source>
        <translation>恢复</translation>
    </message>
    <message>
        <source>Misfit / px (x: left out)</source>
        <translation>拟合误差 / px（x：已舍去）</translation>
    </message>
    <message>
        <source>image</source>
        <translation>图像</translation>
    </message>
    <message>
        <source>{0} of {1} used</source>
        <translation>使用 {0} / {1} 幅</translation>
    </message>
    <message>
        <source>{0} {1}</source>
        <translation>{1} {0} 幅</translation>
    </message>
    <message>
        <source>; </source>
        <translation>；</translation>
    </message>
    <message>
        <source>No image is selected.</source>
        <translation>未选择图像。</translation>
    </message>
    <message>
        <source>It does not take part already.</source>
        <translation>该图像本来就不参与计算。</translation>
    </message>
    <message>
        <source>Leave the selected images out and solve again (Delete)</source>
        <translation>剔除所选图像并重新求解（Delete）</translation>
    </message>
    <message>
        <source>Let the selected images take part again (Insert)</source>
        <translation>恢复所选图像并重新求解（Insert）</translation>
    </message>
    <message>
        <source>It takes part already.</source>
        <translation>该图像已参与计算。</translation>
    </message>
    <message>
        <source>It would be left out again: {0}.</source>
        <translation>仍会被舍去：{0}。</translation>
    </message>
    <message>
        <source>Image {0}; arrows: residuals × {1}</source>
        <translation>图像 {0}；箭头：残差 × {1}</translation>
    </message>
    <message>
        <source>Image {0}: the pen is not found. {1}</source>
        <translation>图像 {0}：未找到光笔。{1}</translation>
    </message>
    <message>
        <source>The image cannot be shown.</source>
        <translation>无法显示该图像。</translation>
    </message>
</context>
<context>
    <name>InterruptedPanel</name>
    <message>
        <source>Interrupted swings: {0}</source>
        <translation>中断的摆动：{0}</translation>
    </message>
    <message>
        <source>Interrupted swing</source>
        <translation>中断的摆动</translation>
    </message>
    <message>
        <source>Resumed, it has all its images and the files it began with.</source>
        <translation>继续时保留全部图像，并使用开始时的文件。</translation>
    </message>
    <message>
        <source>Look again</source>
        <translation>重新查找</translation>
    </message>
</context>
<context>
    <name>InterruptedRow</name>
    <message>
        <source>d MMM yyyy, hh:mm</source>
        <translation>yyyy年M月d日 hh:mm</translation>
    </message>
    <message>
        <source>Discard it? Its images stay on the disk.</source>
        <translation>放弃吗？图像留在磁盘上。</translation>
    </message>
    <message>
        <source>Resume</source>
        <translation>继续</translation>
    </message>
    <message>
        <source>Resume the swing of {0}</source>
        <translation>继续 {0} 的摆动</translation>
    </message>
    <message>
        <source>Discard</source>
        <translation>放弃</translation>
    </message>
    <message>
        <source>Discard the swing of {0}</source>
        <translation>放弃 {0} 的摆动</translation>
    </message>
    <message>
        <source>Keep</source>
        <translation>保留</translation>
    </message>
    <message>
        <source>Keep the swing of {0}</source>
        <translation>保留 {0} 的摆动</translation>
    </message>
    <message>
        <source>Damaged: {0}</source>
        <translation>已损坏：{0}</translation>
    </message>
    <message>
        <source>Another program is capturing it.</source>
        <translation>另一个程序正在采集。</translation>
    </message>
</context>
<context>
    <name>IntrinsicsPanel</name>
    <message>
        <source>Intrinsics of camera and lens</source>
        <translation>相机与镜头的内参</translation>
    </message>
    <message>
        <source>Intrinsics of OpenCV, ROS, Kalibr, MATLAB ({0})</source>
        <translation>OpenCV、ROS、Kalibr、MATLAB 内参 ({0})</translation>
    </message>
    <message>
        <source>Intrinsics file</source>
        <translation>内参文件</translation>
    </message>
    <message>
        <source>Open...</source>
        <translation>打开...</translation>
    </message>
    <message>
        <source>In use</source>
        <translation>使用中</translation>
    </message>
    <message>
        <source>Focal lengths</source>
        <translation>焦距</translation>
    </message>
    <message>
        <source>Principal point</source>
        <translation>主点</translation>
    </message>
    <message>
        <source>Distortion</source>
        <translation>畸变</translation>
    </message>
    <message>
        <source>Calibrated</source>
        <translation>标定日期</translation>
    </message>
    <message>
        <source>Open the file with the calibration of camera and lens.</source>
        <translation>打开相机与镜头的标定文件。</translation>
    </message>
    <message>
        <source>Made for images of {0}</source>
        <translation>适用的图像尺寸：{0}</translation>
    </message>
    <message>
        <source>Fits the live images: {0}</source>
        <translation>与实时图像一致：{0}</translation>
    </message>
    <message>
        <source>The camera sends {0}, the calibration file was made for {1}. Choose the file for this camera or switch off binning.</source>
        <translation>相机图像为 {0}，标定文件适用于 {1}。请选择该相机的文件，或关闭像素合并。</translation>
    </message>
    <message>
        <source>no date</source>
        <translation>无日期</translation>
    </message>
    <message>
        <source>, no uncertainty in the file</source>
        <translation>，文件未给出不确定度</translation>
    </message>
    <message>
        <source>{0} and {1} px</source>
        <translation>{0} 和 {1} px</translation>
    </message>
    <message>
        <source>{0} x {1}</source>
        <translation>{0} × {1}</translation>
    </message>
</context>
<context>
    <name>LastResultPanel</name>
    <message>
        <source>Last calibration of this pen and tip</source>
        <translation>本光笔和测头的上次校准</translation>
    </message>
    <message>
        <source>None yet</source>
        <translation>尚无结果</translation>
    </message>
    <message>
        <source>The tip that you accept will be the first in force.</source>
        <translation>您接受的测头将首次生效。</translation>
    </message>
    <message>
        <source>It is shown when the pen and its tip are named.</source>
        <translation>填写光笔和测头后显示。</translation>
    </message>
    <message>
        <source>d MMMM yyyy, hh:mm</source>
        <translation>yyyy年M月d日 hh:mm</translation>
    </message>
    <message>
        <source>Tip centre / mm</source>
        <translation>测头中心 / mm</translation>
    </message>
    <message>
        <source>U (k = 2) / mm</source>
        <translation>U (k = 2) / mm</translation>
    </message>
    <message>
        <source>It is dated later than now. Check the clock here.</source>
        <translation>日期晚于现在。请检查本机时钟。</translation>
    </message>
    <message>
        <source>It is older than {0} days. Calibrate before you measure.</source>
        <translation>已超过 {0} 天。测量前请先校准。</translation>
    </message>
    <message>
        <source>In the future</source>
        <translation>日期在将来</translation>
    </message>
    <message>
        <source>Today</source>
        <translation>今天</translation>
    </message>
    <message>
        <source>Yesterday</source>
        <translation>昨天</translation>
    </message>
    <message>
        <source>{0} days ago</source>
        <translation>{0} 天前</translation>
    </message>
    <message>
        <source>{0} months ago</source>
        <translation>{0} 个月前</translation>
    </message>
    <message>
        <source>{0} years ago</source>
        <translation>{0} 年前</translation>
    </message>
</context>
<context>
    <name>LeaningDial</name>
    <message>
        <source>Drag to lean the simulated pen, or use the arrow keys. The wheel, or the keys , and . turn it about its own axis.</source>
        <translation>拖动或用方向键倾斜模拟光笔。滚轮或 , 和 . 键使其绕自身轴线转动。</translation>
    </message>
</context>
<context>
    <name>LedFilePanel</name>
    <message>
        <source>Cancel</source>
        <translation>取消</translation>
    </message>
    <message>
        <source>LEDs of the pen</source>
        <translation>光笔的 LED</translation>
    </message>
    <message>
        <source>LEDs of a pen ({0})</source>
        <translation>光笔 LED 文件 ({0})</translation>
    </message>
    <message>
        <source>Save the LEDs</source>
        <translation>保存 LED</translation>
    </message>
    <message>
        <source>Tables ({0})</source>
        <translation>表格 ({0})</translation>
    </message>
    <message>
        <source>With name and nominal tip ({0})</source>
        <translation>含名称和标称测头 ({0})</translation>
    </message>
    <message>
        <source>{0} exists already. Replace it by these LEDs?</source>
        <translation>{0} 已存在。用这些 LED 替换它吗？</translation>
    </message>
    <message>
        <source>Replace</source>
        <translation>替换</translation>
    </message>
    <message>
        <source>LED &amp;file</source>
        <translation>LED 文件(&amp;F)</translation>
    </message>
    <message>
        <source>LED file</source>
        <translation>LED 文件</translation>
    </message>
    <message>
        <source>Table (CSV) or JSON file</source>
        <translation>表格 (CSV) 或 JSON 文件</translation>
    </message>
    <message>
        <source>Open...</source>
        <translation>打开...</translation>
    </message>
    <message>
        <source>Save as...</source>
        <translation>另存为...</translation>
    </message>
    <message>
        <source>Use the simulated pen&apos;s file</source>
        <translation>使用模拟光笔的文件</translation>
    </message>
    <message>
        <source>Save the LEDs and use that file.</source>
        <translation>保存 LED 并使用该文件。</translation>
    </message>
</context>
<context>
    <name>LedTable</name>
    <message>
        <source>LEDs of the pen, in mm</source>
        <translation>光笔的 LED，单位 mm</translation>
    </message>
</context>
<context>
    <name>LedTablePanel</name>
    <message>
        <source>Places of the LEDs in mm, changed</source>
        <translation>LED 位置 / mm（已修改）</translation>
    </message>
    <message>
        <source>Places of the LEDs in mm</source>
        <translation>LED 位置 / mm</translation>
    </message>
    <message>
        <source>Add an LED after the last.</source>
        <translation>在末尾添加一个 LED。</translation>
    </message>
    <message>
        <source>Choose an LED in the table first.</source>
        <translation>请先在表格中选择一个 LED。</translation>
    </message>
    <message>
        <source>A pen needs at least {0} LEDs.</source>
        <translation>光笔至少需要 {0} 个 LED。</translation>
    </message>
    <message>
        <source>Remove LED {0}; later ones get lower numbers.</source>
        <translation>删除 LED {0}；后面的编号依次前移。</translation>
    </message>
    <message>
        <source>Nothing is changed.</source>
        <translation>没有修改。</translation>
    </message>
    <message>
        <source>Go back to what the file has.</source>
        <translation>恢复为文件中的内容。</translation>
    </message>
    <message>
        <source>Go back to the file in use.</source>
        <translation>恢复为使用中的文件。</translation>
    </message>
    <message>
        <source>In force is the nominal tip of the step Start: {0} mm.</source>
        <translation>有效的是“开始”步骤中的标称测头：{0} mm。</translation>
    </message>
    <message>
        <source>Add</source>
        <translation>添加</translation>
    </message>
    <message>
        <source>Remove</source>
        <translation>删除</translation>
    </message>
    <message>
        <source>Discard</source>
        <translation>放弃</translation>
    </message>
    <message>
        <source>Show normals</source>
        <translation>显示法线</translation>
    </message>
    <message>
        <source>&amp;Disc Ø, mm</source>
        <translation>发光面 Ø, mm(&amp;D)</translation>
    </message>
    <message>
        <source>Diameter of the LED discs, mm</source>
        <translation>LED 发光面直径，mm</translation>
    </message>
    <message>
        <source>&amp;Tip x y z, mm</source>
        <translation>测头 x y z, mm(&amp;T)</translation>
    </message>
    <message>
        <source>Nominal centre of the tip, {0}, mm</source>
        <translation>测头标称中心 {0}，mm</translation>
    </message>
</context>
<context>
    <name>LedsPage</name>
    <message>
        <source>LEDs</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>Open the file of this pen&apos;s LEDs and hold the pen before the camera.</source>
        <translation>打开本光笔的 LED 文件，并把光笔举在相机前。</translation>
    </message>
    <message>
        <source>Continue to the swing</source>
        <translation>继续：摆动</translation>
    </message>
    <message>
        <source>The LED table has changes that are not saved.</source>
        <translation>LED 表格有未保存的修改。</translation>
    </message>
    <message>
        <source>Mend the LED table first: what is wrong is told above.</source>
        <translation>请先改正 LED 表格：错误见上方说明。</translation>
    </message>
    <message>
        <source>Save the LED table first: the record needs its file.</source>
        <translation>请先保存 LED 表格：记录需要该文件。</translation>
    </message>
    <message>
        <source>There are no LEDs yet.</source>
        <translation>还没有 LED。</translation>
    </message>
    <message>
        <source>Mend the LEDs first: a file of these cannot be used.</source>
        <translation>请先改正 LED：这样的文件无法使用。</translation>
    </message>
    <message>
        <source>Discard them</source>
        <translation>放弃修改</translation>
    </message>
    <message>
        <source>{0} stays open.</source>
        <translation>{0} 仍处于打开状态。</translation>
    </message>
    <message>
        <source>The LEDs are saved as {0} and in use.</source>
        <translation>LED 已保存为 {0} 并使用。</translation>
    </message>
    <message>
        <source>The camera is not open. See the step Camera.</source>
        <translation>相机未打开。请看“相机”步骤。</translation>
    </message>
    <message>
        <source>The camera is lost. It is looked for until it is back.</source>
        <translation>相机连接中断。程序会持续查找，直到恢复。</translation>
    </message>
    <message>
        <source>The intrinsics are missing. See the step Camera.</source>
        <translation>缺少内参。请看“相机”步骤。</translation>
    </message>
    <message>
        <source>Enter or mend the LEDs, so that they can be looked for.</source>
        <translation>请先输入或改正 LED，才能进行查找。</translation>
    </message>
</context>
<context>
    <name>LimitsForm</name>
    <message>
        <source>Limits of the swing</source>
        <translation>摆动限值</translation>
    </message>
    <message>
        <source>U (k = 2) at most</source>
        <translation>U (k = 2) 上限</translation>
    </message>
    <message>
        <source>Images at least</source>
        <translation>最少图像数</translation>
    </message>
    <message>
        <source>Images at most</source>
        <translation>最多图像数</translation>
    </message>
    <message>
        <source>The swing ends when the tip is as certain as this along its weakest direction. Usual: {0} mm.</source>
        <translation>测头在最弱方向上达到此不确定度时，摆动结束。通常：{0} mm。</translation>
    </message>
    <message>
        <source>The swing does not end with fewer. Usual: {0}.</source>
        <translation>少于此数时摆动不会结束。通常：{0}。</translation>
    </message>
    <message>
        <source>The swing ends with so many in any case. Usual: {0}.</source>
        <translation>达到此数时摆动一定结束。通常：{0}。</translation>
    </message>
</context>
<context>
    <name>LivePanel</name>
    <message>
        <source>Wheel or + and - enlarge, arrow keys move, 0 shows all.</source>
        <translation>滚轮或 + 和 - 缩放，方向键移动，0 显示全图。</translation>
    </message>
    <message>
        <source>Connecting</source>
        <translation>正在连接</translation>
    </message>
    <message>
        <source>Live</source>
        <translation>实时</translation>
    </message>
    <message>
        <source>Silent</source>
        <translation>无图像</translation>
    </message>
    <message>
        <source>Lost, reconnecting</source>
        <translation>连接中断，正在重连</translation>
    </message>
    <message>
        <source>Not connected</source>
        <translation>未连接</translation>
    </message>
    <message>
        <source>The camera is being opened.</source>
        <translation>正在打开相机。</translation>
    </message>
    <message>
        <source>The first image is on its way.</source>
        <translation>正在等待第一幅图像。</translation>
    </message>
    <message>
        <source>The camera answers but sends no images. Check its trigger and its cable.</source>
        <translation>相机有响应但没有送来图像。请检查触发和电缆。</translation>
    </message>
    <message>
        <source>{0} It is looked for until it is back.</source>
        <translation>{0} 程序会持续查找，直到恢复。</translation>
    </message>
    <message>
        <source>{0} x {1} px</source>
        <translation>{0} × {1} px</translation>
    </message>
    <message>
        <source>{0} images/s</source>
        <translation>{0} 幅/秒</translation>
    </message>
    <message>
        <source>lost: {0}</source>
        <translation>丢失：{0}</translation>
    </message>
    <message>
        <source>bright spots: {0}</source>
        <translation>亮点：{0}</translation>
    </message>
    <message>
        <source>{0} of {1} LEDs</source>
        <translation>{0} / {1} 个 LED</translation>
    </message>
    <message>
        <source>, other spots: {0}</source>
        <translation>，其他光点：{0}</translation>
    </message>
</context>
<context>
    <name>MainWindow</name>
    <message>
        <source>The program made a mistake of its own and goes on. All images taken so far are safe. Please send this report to its makers: {0}</source>
        <translation>程序自身出错，但会继续运行。已采集的图像全部安全。请将此报告发给开发者：{0}</translation>
    </message>
    <message>
        <source>The program made a mistake of its own and goes on. All images taken so far are safe. No report could be written: the disk is full or not yours to write.</source>
        <translation>程序自身出错，但会继续运行。已采集的图像全部安全。无法写入报告：磁盘已满或没有写入权限。</translation>
    </message>
    <message>
        <source>Press this button at the screen.</source>
        <translation>请在屏幕前按此按钮。</translation>
    </message>
    <message>
        <source>Sounds are off.</source>
        <translation>声音已关闭。</translation>
    </message>
    <message>
        <source>Sounds are on.</source>
        <translation>声音已打开。</translation>
    </message>
    <message>
        <source>Stay</source>
        <translation>不关闭</translation>
    </message>
    <message>
        <source>Close anyway</source>
        <translation>仍然关闭</translation>
    </message>
    <message>
        <source>Pen tip calibration</source>
        <translation>光笔测头校准</translation>
    </message>
</context>
<context>
    <name>MatchPanel</name>
    <message>
        <source>Live match</source>
        <translation>实时匹配</translation>
    </message>
    <message>
        <source>Wheel or + and - enlarge, arrow keys move, 0 shows all.</source>
        <translation>滚轮或 + 和 - 缩放，方向键移动，0 显示全图。</translation>
    </message>
    <message>
        <source>No image comes yet.</source>
        <translation>还没有图像。</translation>
    </message>
    <message>
        <source>No match yet</source>
        <translation>尚无匹配</translation>
    </message>
    <message>
        <source>Pen not found</source>
        <translation>未找到光笔</translation>
    </message>
    <message>
        <source>{0} of {1} LEDs</source>
        <translation>{0} / {1} 个 LED</translation>
    </message>
    <message>
        <source>misfit {0} px</source>
        <translation>拟合误差 {0} px</translation>
    </message>
    <message>
        <source>Lean and turn the pen, so that it is seen from all sides.</source>
        <translation>倾斜并转动光笔，让相机从各个方向看到它。</translation>
    </message>
    <message>
        <source>The LEDs fit the images, but not the pen frame: see what is told of the file.</source>
        <translation>LED 与图像相符，但不符合测笔坐标系：请看文件处的说明。</translation>
    </message>
    <message>
        <source>Every LED is within {0} mm of its place in the table, in {1} views.</source>
        <translation>在 {1} 个视角中，每个 LED 与表中位置相差均不超过 {0} mm。</translation>
    </message>
    <message>
        <source>{0} of LEDs {1} and {2} are exchanged in the table.</source>
        <translation>表格中 LED {1} 和 {2} 的 {0} 互换了。</translation>
    </message>
    <message>
        <source>LED {0} sits {1} mm off its place: {2}, {3}, {4} mm.</source>
        <translation>LED {0} 偏离位置 {1} mm：{2}, {3}, {4} mm。</translation>
    </message>
    <message>
        <source>LED {0} sits off its place. Lean and turn the pen to see by how much.</source>
        <translation>LED {0} 偏离位置。倾斜并转动光笔，以确定偏离多少。</translation>
    </message>
    <message>
        <source>LED {0} or {1} sits off its place, by {2} mm.</source>
        <translation>LED {0} 或 {1} 偏离位置 {2} mm。</translation>
    </message>
    <message>
        <source>LED {0} is not seen where the table has it. A finger may cover it, it is off, or its place is wrong.</source>
        <translation>在表格给出的位置看不到 LED {0}。可能被手指遮住、没有点亮，或位置有误。</translation>
    </message>
    <message>
        <source>A light at {0}, {1}, {2} mm moves with the pen. Is an LED missing in the table?</source>
        <translation>位于 {0}, {1}, {2} mm 的光点随光笔移动。表格中是否缺少一个 LED？</translation>
    </message>
    <message>
        <source>The LEDs fit to {0} px, {1} px or less is usual. Is this the LED file of this pen, and the intrinsics file of this camera and lens?</source>
        <translation>LED 拟合误差为 {0} px，通常不超过 {1} px。LED 文件是否属于本光笔，内参文件是否属于这台相机和镜头？</translation>
    </message>
</context>
<context>
    <name>MethodsPanel</name>
    <message>
        <source>Objective / mm²</source>
        <translation>目标函数 / mm²</translation>
    </message>
    <message>
        <source>iteration</source>
        <translation>迭代次数</translation>
    </message>
    <message>
        <source>Tip minus its end / µm</source>
        <translation>测头与终值之差 / µm</translation>
    </message>
    <message>
        <source>Two-stage method beside the joint fit</source>
        <translation>两步法与联合拟合的比较</translation>
    </message>
    <message>
        <source>Joint fit</source>
        <translation>联合拟合</translation>
    </message>
    <message>
        <source>its U (k = 2)</source>
        <translation>其 U (k = 2)</translation>
    </message>
    <message>
        <source>Two-stage (paper)</source>
        <translation>两步法（论文）</translation>
    </message>
    <message>
        <source>its U, of noise alone</source>
        <translation>其 U，仅含噪声</translation>
    </message>
    <message>
        <source>difference</source>
        <translation>差值</translation>
    </message>
    <message>
        <source>rms / mm</source>
        <translation>均方根 / mm</translation>
    </message>
</context>
<context>
    <name>NamesForm</name>
    <message>
        <source>Where and who</source>
        <translation>工位与人员</translation>
    </message>
    <message>
        <source>What is calibrated</source>
        <translation>校准对象</translation>
    </message>
    <message>
        <source>Station</source>
        <translation>工位</translation>
    </message>
    <message>
        <source>Operator</source>
        <translation>操作员</translation>
    </message>
    <message>
        <source>Pen, serial number</source>
        <translation>光笔序列号</translation>
    </message>
    <message>
        <source>Cone</source>
        <translation>锥孔</translation>
    </message>
    <message>
        <source>Probe tip</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>Ball diameter</source>
        <translation>测球直径</translation>
    </message>
    <message>
        <source>Nominal centre of the tip</source>
        <translation>测头标称中心</translation>
    </message>
    <message>
        <source>Choose a station to bring back all that was chosen there, or type the name of a new one.</source>
        <translation>选择已有工位可恢复其全部设置；也可输入新工位的名称。</translation>
    </message>
    <message>
        <source>not known</source>
        <translation>未知</translation>
    </message>
</context>
<context>
    <name>NoticeBar</name>
    <message>
        <source>Close</source>
        <translation>关闭</translation>
    </message>
</context>
<context>
    <name>OperatorView</name>
    <message>
        <source>Operator view</source>
        <translation>操作员视图</translation>
    </message>
</context>
<context>
    <name>OptionsMenu</name>
    <message>
        <source>As the system</source>
        <translation>跟随系统</translation>
    </message>
    <message>
        <source>Light</source>
        <translation>浅色</translation>
    </message>
    <message>
        <source>Dark</source>
        <translation>深色</translation>
    </message>
    <message>
        <source>{0} m</source>
        <translation>{0} 米</translation>
    </message>
    <message>
        <source>Language</source>
        <translation>语言</translation>
    </message>
    <message>
        <source>Appearance</source>
        <translation>外观</translation>
    </message>
    <message>
        <source>Viewing distance</source>
        <translation>观看距离</translation>
    </message>
    <message>
        <source>Mute the sounds</source>
        <translation>关闭声音</translation>
    </message>
    <message>
        <source>About Lightpen</source>
        <translation>关于 Lightpen</translation>
    </message>
</context>
<context>
    <name>PenView</name>
    <message>
        <source>The LEDs appear here.</source>
        <translation>LED 显示在这里。</translation>
    </message>
    <message>
        <source>tip</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>The LEDs in space</source>
        <translation>LED 空间视图</translation>
    </message>
    <message>
        <source>{0} LEDs</source>
        <translation>{0} 个 LED</translation>
    </message>
    <message>
        <source>Drag the mouse or press the arrow keys to turn it, 0 to reset.</source>
        <translation>拖动鼠标或按方向键转动，按 0 复位。</translation>
    </message>
</context>
<context>
    <name>PlotCard</name>
    <message>
        <source>Saved as {0}</source>
        <translation>已保存为 {0}</translation>
    </message>
    <message>
        <source>Save plot</source>
        <translation>保存图表</translation>
    </message>
    <message>
        <source>Enlarge</source>
        <translation>放大</translation>
    </message>
    <message>
        <source>Save picture (PNG)</source>
        <translation>保存图片 (PNG)</translation>
    </message>
    <message>
        <source>Save numbers (CSV)</source>
        <translation>保存数据 (CSV)</translation>
    </message>
    <message>
        <source>Enlarge or save this plot</source>
        <translation>放大或保存此图表</translation>
    </message>
</context>
<context>
    <name>PointField</name>
    <message>
        <source>As in the LED file</source>
        <translation>同 LED 文件</translation>
    </message>
    <message>
        <source>As in the LED file: {0} mm</source>
        <translation>同 LED 文件：{0} mm</translation>
    </message>
    <message>
        <source>Nominal centre of the tip, {0}</source>
        <translation>测头标称中心 {0}</translation>
    </message>
</context>
<context>
    <name>PostureDial</name>
    <message>
        <source>Postures</source>
        <translation>姿态</translation>
    </message>
    <message>
        <source>{0} of {1} postures are done.</source>
        <translation>{1} 个姿态中已完成 {0} 个。</translation>
    </message>
    <message>
        <source>camera</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>turn about the pen&apos;s own axis</source>
        <translation>绕光笔自身轴线转动</translation>
    </message>
</context>
<context>
    <name>ResidualView</name>
    <message>
        <source>Recorded image</source>
        <translation>记录的图像</translation>
    </message>
</context>
<context>
    <name>ResidualsPanel</name>
    <message>
        <source>Residuals × {0}</source>
        <translation>残差 × {0}</translation>
    </message>
    <message>
        <source>x / px</source>
        <translation>x / px</translation>
    </message>
    <message>
        <source>y / px</source>
        <translation>y / px</translation>
    </message>
    <message>
        <source>By axis / px</source>
        <translation>按坐标轴 / px</translation>
    </message>
    <message>
        <source>By LED / px</source>
        <translation>按 LED / px</translation>
    </message>
    <message>
        <source>LED</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>rms</source>
        <translation>均方根</translation>
    </message>
    <message>
        <source>mean x</source>
        <translation>x 均值</translation>
    </message>
    <message>
        <source>mean y</source>
        <translation>y 均值</translation>
    </message>
    <message>
        <source>Beside the normal curve</source>
        <translation>与正态曲线比较</translation>
    </message>
    <message>
        <source>residual / px</source>
        <translation>残差 / px</translation>
    </message>
    <message>
        <source>count</source>
        <translation>数量</translation>
    </message>
    <message>
        <source>The arrows should look random. A pattern points to the intrinsics file, one LED that stands out to the LED file.</source>
        <translation>箭头应随机分布。若有规律，请检查内参文件；若某个 LED 突出，请检查 LED 文件。</translation>
    </message>
</context>
<context>
    <name>ResultPanel</name>
    <message>
        <source>Tip in the frame of the pen / mm, with U (k = 2)</source>
        <translation>光笔坐标系中的测头 / mm，含 U (k = 2)</translation>
    </message>
    <message>
        <source>Differences / µm</source>
        <translation>差值 / µm</translation>
    </message>
    <message>
        <source>Differences</source>
        <translation>差值</translation>
    </message>
    <message>
        <source>{0} of {1} images used</source>
        <translation>使用 {0} / {1} 幅图像</translation>
    </message>
    <message>
        <source>Tip {0} in the frame of pen {1} / mm, U&#xa0;(k&#xa0;=&#xa0;2)</source>
        <translation>测头 {0}（光笔 {1} 坐标系）/ mm，U&#xa0;(k&#xa0;=&#xa0;2)</translation>
    </message>
    <message>
        <source>its U (k = 2)</source>
        <translation>其 U (k = 2)</translation>
    </message>
    <message>
        <source>no earlier result</source>
        <translation>无更早结果</translation>
    </message>
    <message>
        <source>since {0}</source>
        <translation>与 {0} 相比</translation>
    </message>
    <message>
        <source>no nominal tip</source>
        <translation>无标称测头</translation>
    </message>
    <message>
        <source>since nominal</source>
        <translation>与标称相比</translation>
    </message>
    <message>
        <source>odd - even</source>
        <translation>奇数 - 偶数</translation>
    </message>
    <message>
        <source>Odd and even images agree</source>
        <translation>奇数与偶数图像一致</translation>
    </message>
    <message>
        <source>Odd and even images differ by more than chance</source>
        <translation>奇数与偶数图像的差异超出随机范围</translation>
    </message>
</context>
<context>
    <name>ReviewDoubts</name>
    <message>
        <source>This swing is of tip {0}, pen {1}, whatever the step Start names now: tip {2}, pen {3}.</source>
        <translation>本次摆动属于测头 {0}、光笔 {1}；“开始”步骤现在填写的是测头 {2}、光笔 {3}。</translation>
    </message>
    <message>
        <source>The tip lies {0} mm from the calibration of {1} (usual change: {2} mm). Was the tip exchanged?</source>
        <translation>测头与 {1} 的校准相差 {0} mm（通常变化：{2} mm）。是否更换过测头？</translation>
    </message>
    <message>
        <source>The tip lies {0} mm from its nominal place. Is it the tip that is named?</source>
        <translation>测头偏离标称位置 {0} mm。是否为所填写的测头？</translation>
    </message>
</context>
<context>
    <name>ReviewPage</name>
    <message>
        <source>Review</source>
        <translation>复核</translation>
    </message>
    <message>
        <source>Next: start the next calibration, or close the program.</source>
        <translation>下一步：开始下一次校准，或关闭程序。</translation>
    </message>
    <message>
        <source>Nothing is in force until it is accepted.</source>
        <translation>接受之前，结果不会生效。</translation>
    </message>
    <message>
        <source>{0} The old one stays in force until then.</source>
        <translation>{0}在此之前旧数据一直有效。</translation>
    </message>
    <message>
        <source>Swing the pen first.</source>
        <translation>请先摆动光笔。</translation>
    </message>
    <message>
        <source>The tip is in force.</source>
        <translation>测头已生效。</translation>
    </message>
    <message>
        <source>Start the next calibration</source>
        <translation>开始下一次校准</translation>
    </message>
    <message>
        <source>Accept</source>
        <translation>接受</translation>
    </message>
    <message>
        <source>The tip is not accepted. The swing is kept and offered again at the next start.</source>
        <translation>测头尚未接受。本次摆动已保留，下次启动时会再次列出。</translation>
    </message>
    <message>
        <source>Images</source>
        <translation>图像</translation>
    </message>
    <message>
        <source>Residuals</source>
        <translation>残差</translation>
    </message>
    <message>
        <source>Uncertainty</source>
        <translation>不确定度</translation>
    </message>
    <message>
        <source>Two-stage</source>
        <translation>两步法</translation>
    </message>
    <message>
        <source>Result</source>
        <translation>结果</translation>
    </message>
    <message>
        <source>Details</source>
        <translation>详细信息</translation>
    </message>
    <message>
        <source>Progress of the computation</source>
        <translation>计算进度</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>取消</translation>
    </message>
    <message>
        <source>Keep the last solution</source>
        <translation>保留上次的解</translation>
    </message>
    <message>
        <source>Capture more</source>
        <translation>继续采集</translation>
    </message>
    <message>
        <source>Repeat</source>
        <translation>重做</translation>
    </message>
    <message>
        <source>Repeat the swing from the start? These images stay on the disk.</source>
        <translation>从头重做摆动吗？这些图像仍保留在磁盘上。</translation>
    </message>
    <message>
        <source>Go on with these</source>
        <translation>沿用这些图像</translation>
    </message>
    <message>
        <source>The tip is being computed.</source>
        <translation>正在计算测头。</translation>
    </message>
    <message>
        <source>The swing goes on.</source>
        <translation>摆动继续进行。</translation>
    </message>
    <message>
        <source>Not good enough: capture more images, or repeat the swing.</source>
        <translation>结果不够好：请继续采集图像，或重做摆动。</translation>
    </message>
    <message>
        <source>The tip is accepted; start the next calibration.</source>
        <translation>测头已接受；请开始下一次校准。</translation>
    </message>
    <message>
        <source>Add images to this swing</source>
        <translation>为本次摆动增加图像</translation>
    </message>
    <message>
        <source>Swing anew without these images</source>
        <translation>不用这些图像，重新摆动</translation>
    </message>
    <message>
        <source>Since {0}. Earlier results are kept.</source>
        <translation>自 {0} 起。更早的结果均保留。</translation>
    </message>
    <message>
        <source>IN FORCE</source>
        <translation>已生效</translation>
    </message>
    <message>
        <source>The tip shows here once the pen is swung.</source>
        <translation>摆动光笔后，测头显示在这里。</translation>
    </message>
    <message>
        <source>NO TIP YET</source>
        <translation>尚无结果</translation>
    </message>
    <message>
        <source>{0}: {1}</source>
        <translation>{0}：{1}</translation>
    </message>
</context>
<context>
    <name>Sidebar</name>
    <message>
        <source>Pen tip calibration</source>
        <translation>光笔测头校准</translation>
    </message>
    <message>
        <source>Operator view</source>
        <translation>操作员视图</translation>
    </message>
    <message>
        <source>Help</source>
        <translation>帮助</translation>
    </message>
    <message>
        <source>Options</source>
        <translation>选项</translation>
    </message>
</context>
<context>
    <name>SoundTest</name>
    <message>
        <source>No sound here: {0}. All is shown in words and signs, too.</source>
        <translation>本机无声音：{0}。所有信息也以文字和符号显示。</translation>
    </message>
    <message>
        <source>Sounds are off. Press B to switch them on.</source>
        <translation>声音已关闭。按 B 打开。</translation>
    </message>
    <message>
        <source>Tip seated</source>
        <translation>测头就位</translation>
    </message>
    <message>
        <source>Image kept</source>
        <translation>保留图像</translation>
    </message>
    <message>
        <source>Field full</source>
        <translation>区域已满</translation>
    </message>
    <message>
        <source>Tip slipped, or pen lost</source>
        <translation>测头滑动，或光笔丢失</translation>
    </message>
    <message>
        <source>All captured</source>
        <translation>采集完毕</translation>
    </message>
    <message>
        <source>Done</source>
        <translation>完成</translation>
    </message>
    <message>
        <source>Failed</source>
        <translation>失败</translation>
    </message>
    <message>
        <source>Test the sounds</source>
        <translation>测试声音</translation>
    </message>
    <message>
        <source>Plays what you will hear during the swing, one after the other.</source>
        <translation>依次播放摆动时会听到的声音。</translation>
    </message>
</context>
<context>
    <name>SourcePanel</name>
    <message>
        <source>Simulated pen</source>
        <translation>模拟光笔</translation>
    </message>
    <message>
        <source>Recorded images</source>
        <translation>录制的图像</translation>
    </message>
    <message>
        <source>Folder of the recorded images</source>
        <translation>录制图像的文件夹</translation>
    </message>
    <message>
        <source>Video of the pen</source>
        <translation>光笔视频</translation>
    </message>
    <message>
        <source>Videos and images ({0})</source>
        <translation>视频和图像 ({0})</translation>
    </message>
    <message>
        <source>Source of the images</source>
        <translation>图像来源</translation>
    </message>
    <message>
        <source>Folder, record or video</source>
        <translation>文件夹、记录或视频</translation>
    </message>
    <message>
        <source>Open...</source>
        <translation>打开...</translation>
    </message>
    <message>
        <source>Folder or record...</source>
        <translation>文件夹或记录...</translation>
    </message>
    <message>
        <source>Video...</source>
        <translation>视频...</translation>
    </message>
    <message>
        <source>Use its files</source>
        <translation>使用其文件</translation>
    </message>
    <message>
        <source>Use the intrinsics and the LED file of the simulated pen.</source>
        <translation>使用模拟光笔的内参文件和 LED 文件。</translation>
    </message>
    <message>
        <source>Try again</source>
        <translation>重试</translation>
    </message>
</context>
<context>
    <name>StartPage</name>
    <message>
        <source>Start</source>
        <translation>开始</translation>
    </message>
    <message>
        <source>Say what is calibrated. All of it is remembered for the station.</source>
        <translation>填写要校准的内容，程序会为本工位记住。</translation>
    </message>
    <message>
        <source>Continue to the camera</source>
        <translation>继续：相机</translation>
    </message>
    <message>
        <source>Pen {0}</source>
        <translation>光笔 {0}</translation>
    </message>
    <message>
        <source>Cone {0}</source>
        <translation>锥孔 {0}</translation>
    </message>
    <message>
        <source>The last calibration cannot be shown.</source>
        <translation>无法显示上次校准。</translation>
    </message>
    <message>
        <source>The swing is being read.</source>
        <translation>正在读取摆动。</translation>
    </message>
    <message>
        <source>No camera is open. Choose the source of the images at the step Camera, then resume the swing here.</source>
        <translation>相机未打开。请在“相机”步骤选择图像来源，再回到这里继续摆动。</translation>
    </message>
    <message>
        <source>The camera sends {0} x {1}, the swing was captured with {2} x {3}. Choose its camera at the step Camera, then resume the swing here.</source>
        <translation>相机图像为 {0} × {1}，该摆动采集时为 {2} × {3}。请在“相机”步骤选择当时的相机，再回到这里继续摆动。</translation>
    </message>
    <message>
        <source>The swing is being discarded.</source>
        <translation>正在放弃摆动。</translation>
    </message>
    <message>
        <source>Discarded. The images stay in {0}.</source>
        <translation>已放弃。图像保留在 {0}。</translation>
    </message>
</context>
<context>
    <name>StepButton</name>
    <message>
        <source>done</source>
        <translation>已完成</translation>
    </message>
    <message>
        <source>now</source>
        <translation>进行中</translation>
    </message>
    <message>
        <source>to do</source>
        <translation>待完成</translation>
    </message>
    <message>
        <source>closed</source>
        <translation>未开放</translation>
    </message>
</context>
<context>
    <name>StepList</name>
    <message>
        <source>Steps</source>
        <translation>步骤</translation>
    </message>
</context>
<context>
    <name>StrayLightPanel</name>
    <message>
        <source>Stray light</source>
        <translation>杂散光</translation>
    </message>
    <message>
        <source>Cover the pen, then search for what still shines.</source>
        <translation>遮住光笔，再搜索仍然发亮的地方。</translation>
    </message>
    <message>
        <source>Search</source>
        <translation>搜索</translation>
    </message>
    <message>
        <source>Clear the mask</source>
        <translation>清除屏蔽</translation>
    </message>
    <message>
        <source>Uncover the LEDs</source>
        <translation>取消遮挡</translation>
    </message>
    <message>
        <source>Cover the LEDs</source>
        <translation>遮住 LED</translation>
    </message>
    <message>
        <source>The simulated operator does it.</source>
        <translation>由模拟操作员完成。</translation>
    </message>
    <message>
        <source>Mask the spots: {0}</source>
        <translation>屏蔽光点：{0}</translation>
    </message>
    <message>
        <source>Mask the spots</source>
        <translation>屏蔽光点</translation>
    </message>
    <message>
        <source>No images come.</source>
        <translation>没有图像。</translation>
    </message>
    <message>
        <source>The search is on.</source>
        <translation>正在搜索。</translation>
    </message>
    <message>
        <source>Nothing was found to mask.</source>
        <translation>没有需要屏蔽的光点。</translation>
    </message>
    <message>
        <source>Nothing is masked.</source>
        <translation>没有屏蔽。</translation>
    </message>
    <message>
        <source>Masked places: {0}</source>
        <translation>已屏蔽：{0} 处</translation>
    </message>
    <message>
        <source>Searching: image {0} of {1}</source>
        <translation>正在搜索：图像 {0} / {1}</translation>
    </message>
    <message>
        <source>The pen is still seen. Cover all of its LEDs, then search again. Nothing is masked.</source>
        <translation>仍能看到光笔。请遮住全部 LED，再次搜索。没有屏蔽任何光点。</translation>
    </message>
    <message>
        <source>What shines moves, so it is no stray light. Cover the pen, then search again.</source>
        <translation>发亮处在移动，不是杂散光。请遮住光笔，再次搜索。</translation>
    </message>
    <message>
        <source>No stray light: nothing bright is left.</source>
        <translation>没有杂散光：没有其他发亮的地方。</translation>
    </message>
    <message>
        <source>Stray spots: {0}. Mask them, or take their cause away.</source>
        <translation>杂散光点：{0} 个。请屏蔽，或移走光源。</translation>
    </message>
    <message>
        <source>Bright spots: {0}. Is the pen covered? Without its LED file it cannot be told from stray light.</source>
        <translation>亮点：{0} 个。光笔遮住了吗？没有 LED 文件就无法区分光笔与杂散光。</translation>
    </message>
</context>
<context>
    <name>SwingFace</name>
    <message>
        <source>No image yet.</source>
        <translation>还没有图像。</translation>
    </message>
    <message>
        <source>Progress</source>
        <translation>进度</translation>
    </message>
</context>
<context>
    <name>SwingPage</name>
    <message>
        <source>Swing</source>
        <translation>摆动</translation>
    </message>
    <message>
        <source>No image is kept yet.</source>
        <translation>还没有保留的图像。</translation>
    </message>
    <message>
        <source>Finish early</source>
        <translation>提前结束</translation>
    </message>
    <message>
        <source>Review</source>
        <translation>复核</translation>
    </message>
    <message>
        <source>Finish now</source>
        <translation>现在结束</translation>
    </message>
    <message>
        <source>Go on swinging</source>
        <translation>继续摆动</translation>
    </message>
    <message>
        <source>Something else was chosen meanwhile. This swing goes on with the files, names and limits that it began with.</source>
        <translation>期间更改了选择。本次摆动仍使用开始时的文件、名称和限值。</translation>
    </message>
    <message>
        <source>Start over with the new ones</source>
        <translation>用新的重新开始</translation>
    </message>
    <message>
        <source>Go on with this swing</source>
        <translation>继续本次摆动</translation>
    </message>
    <message>
        <source>The swing is not finished. The images kept so far ({0}) are safe; it is offered again at the next start.</source>
        <translation>本次摆动尚未完成。已保留的图像（{0} 幅）是安全的；下次启动时可以继续。</translation>
    </message>
    <message>
        <source>Start over</source>
        <translation>重新开始</translation>
    </message>
    <message>
        <source>Set this swing aside and begin anew. Its images are kept.</source>
        <translation>搁置本次摆动并重新开始。图像会保留。</translation>
    </message>
    <message>
        <source>The tip is being computed.</source>
        <translation>正在计算测头。</translation>
    </message>
    <message>
        <source>The swing goes on.</source>
        <translation>摆动继续进行。</translation>
    </message>
    <message>
        <source>There is no tip to review: capture more, or start over.</source>
        <translation>没有可复核的测头：请继续采集，或重新开始。</translation>
    </message>
    <message>
        <source>The tip is not computed yet.</source>
        <translation>测头尚未计算。</translation>
    </message>
    <message>
        <source>Open the camera</source>
        <translation>打开相机</translation>
    </message>
    <message>
        <source>Try again</source>
        <translation>重试</translation>
    </message>
    <message>
        <source>Go on (Space)</source>
        <translation>继续（空格）</translation>
    </message>
    <message>
        <source>Pause (Space)</source>
        <translation>暂停（空格）</translation>
    </message>
    <message>
        <source>Stop computing</source>
        <translation>停止计算</translation>
    </message>
    <message>
        <source>Compute again</source>
        <translation>重新计算</translation>
    </message>
    <message>
        <source>Capture more</source>
        <translation>继续采集</translation>
    </message>
    <message>
        <source>Begin anew? The images of this swing ({0}) are set aside; they stay on the disk.</source>
        <translation>重新开始？本次摆动的图像（{0} 幅）将被搁置，但仍保留在磁盘上。</translation>
    </message>
    <message>
        <source>Begin anew</source>
        <translation>重新开始</translation>
    </message>
</context>
<context>
    <name>SwingPlots</name>
    <message>
        <source>limit {0}</source>
        <translation>限值 {0}</translation>
    </message>
    <message>
        <source>Misfit of each image / px</source>
        <translation>每幅图像的拟合误差 / px</translation>
    </message>
    <message>
        <source>Tip of each image / µm</source>
        <translation>每幅图像的测头 / µm</translation>
    </message>
    <message>
        <source>Tip estimate / µm</source>
        <translation>测头估计值 / µm</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip / µm</source>
        <translation>测头的 U (k = 2) / µm</translation>
    </message>
</context>
<context>
    <name>SwingRun</name>
    <message>
        <source>Without these images there is no tip, so they stay in. {0}</source>
        <translation>剔除这些图像后求不出测头，因此它们仍参与计算。{0}</translation>
    </message>
</context>
<context>
    <name>SwingSight</name>
    <message>
        <source>The images are not of the size that this swing needs.</source>
        <translation>图像尺寸与本次摆动不符。</translation>
    </message>
    <message>
        <source>{0} of {1} LEDs, {2} images/s</source>
        <translation>{0} / {1} 个 LED，{2} 幅/秒</translation>
    </message>
</context>
<context>
    <name>SwingWords</name>
    <message>
        <source>No swing</source>
        <translation>没有摆动</translation>
    </message>
    <message>
        <source>images kept, at most {0} are taken</source>
        <translation>为已保留的图像，最多采集 {0} 幅</translation>
    </message>
    <message>
        <source>{0}; {1} dropped</source>
        <translation>{0}；已丢弃 {1} 幅</translation>
    </message>
    <message>
        <source>The camera sends none; nothing is lost. Press Space to go on when they come.</source>
        <translation>相机没有发送图像；没有任何丢失。图像恢复后按空格键继续。</translation>
    </message>
    <message>
        <source>Not computed</source>
        <translation>尚未计算</translation>
    </message>
    <message>
        <source>The images are kept. Compute the tip again, or start over.</source>
        <translation>图像已保留。请重新计算测头，或重新开始。</translation>
    </message>
    <message>
        <source>Accepted</source>
        <translation>已接受</translation>
    </message>
    <message>
        <source>Put the pen down.</source>
        <translation>请放下光笔。</translation>
    </message>
    <message>
        <source>An image could not be recorded; the notice at the top says why. Mend it, then press Space.</source>
        <translation>有图像无法记录，原因见顶部提示。排除后按空格键。</translation>
    </message>
    <message>
        <source>Let the simulated operator swing; or press Seat, and lean the pen by dragging the dial.</source>
        <translation>让模拟操作员摆动；或按“就位”，再拖动姿态盘使光笔倾斜。</translation>
    </message>
    <message>
        <source>Done</source>
        <translation>完成</translation>
    </message>
    <message>
        <source>Look at it</source>
        <translation>请查看</translation>
    </message>
    <message>
        <source>Repeat the swing</source>
        <translation>重做摆动</translation>
    </message>
    <message>
        <source>Capture more</source>
        <translation>继续采集</translation>
    </message>
    <message>
        <source>Hold the pen upright and still for 3 s to see the review.</source>
        <translation>把光笔竖直握住不动 3 秒，即可查看结果。</translation>
    </message>
    <message>
        <source>No images</source>
        <translation>没有图像</translation>
    </message>
    <message>
        <source>The camera sends none. The swing goes on by itself as soon as they come; nothing is lost.</source>
        <translation>相机没有送来图像。图像一到，摆动自动继续；不会丢失任何数据。</translation>
    </message>
    <message>
        <source>NO IMAGES</source>
        <translation>没有图像</translation>
    </message>
    <message>
        <source>STOPPED</source>
        <translation>已停止</translation>
    </message>
    <message>
        <source>NOT KEPT</source>
        <translation>未保留</translation>
    </message>
    <message>
        <source>TIP SLIPPED</source>
        <translation>测头滑动</translation>
    </message>
    <message>
        <source>The tip is used from now on.</source>
        <translation>从现在起使用该测头。</translation>
    </message>
    <message>
        <source>IN FORCE</source>
        <translation>已生效</translation>
    </message>
    <message>
        <source>{0} of at least {1}</source>
        <translation>{0} / 至少 {1}</translation>
    </message>
    <message>
        <source>{0} of about {1}</source>
        <translation>{0} / 约 {1}</translation>
    </message>
</context>
<context>
    <name>UncertaintyPanel</name>
    <message>
        <source>Parts of U (k = 2) / µm</source>
        <translation>U (k = 2) 的组成 / µm</translation>
    </message>
    <message>
        <source>Postures: tilt / °</source>
        <translation>姿态：倾角 / °</translation>
    </message>
    <message>
        <source>to the right</source>
        <translation>向右</translation>
    </message>
    <message>
        <source>away from the camera</source>
        <translation>远离相机</translation>
    </message>
    <message>
        <source>noise</source>
        <translation>噪声</translation>
    </message>
    <message>
        <source>LEDs</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>camera</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>all</source>
        <translation>合计</translation>
    </message>
    <message>
        <source>Weakest direction ({0}): U = {1} µm.</source>
        <translation>最弱方向 ({0})：U = {1} µm。</translation>
    </message>
    <message>
        <source>The intrinsics file tells no uncertainty.</source>
        <translation>内参文件未给出不确定度。</translation>
    </message>
    <message>
        <source>Images hang together: their noise counts {0} times (variance).</source>
        <translation>各图像相关：噪声方差按 {0} 倍计。</translation>
    </message>
</context>
<context>
    <name>_DraftModel</name>
    <message>
        <source>How far the LED is seen from where this table puts it, in px of the live images.</source>
        <translation>LED 的实际位置与表格位置之差，以实时图像的 px 计。</translation>
    </message>
    <message>
        <source>LED</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>off, px</source>
        <translation>Δ, px</translation>
    </message>
</context>
<context>
    <name>_UnitsRow</name>
    <message>
        <source>{0} does not say the units of its coordinates. Choose them:</source>
        <translation>{0} 未注明坐标单位。请选择：</translation>
    </message>
    <message>
        <source>Units of the file</source>
        <translation>文件的单位</translation>
    </message>
</context>
<context>
    <name>core</name>
    <message>
        <source>, </source>
        <translation>、</translation>
    </message>
    <message>
        <source>Hold it so that the camera sees its LEDs.</source>
        <translation>握住光笔，使相机能看到 LED。</translation>
    </message>
    <message>
        <source>Images dropped: {n_dropped}. Press the tip into the cone again.</source>
        <translation>已丢弃 {n_dropped} 幅图像。请把测头重新压入锥孔。</translation>
    </message>
    <message>
        <source>Images kept: {n_kept} of at least {needed}.</source>
        <translation>已保留 {n_kept} 幅图像，至少需要 {needed} 幅。</translation>
    </message>
    <message>
        <source>Images of the upright pen still needed: {n_images}.</source>
        <translation>还需 {n_images} 幅光笔竖直的图像。</translation>
    </message>
    <message>
        <source>It rests {distance:.2f} mm from where it was. Put it back into the cone; check that the cone is clamped.</source>
        <translation>测头偏离原位 {distance:.2f} mm。请放回锥孔，并检查锥孔是否夹紧。</translation>
    </message>
    <message>
        <source>Keep the tip pressed into the cone.</source>
        <translation>保持测头压紧在锥孔中。</translation>
    </message>
    <message>
        <source>LED {led} sits {distance:.2f} mm off its place in the LED file. Is this the LED file of this pen?</source>
        <translation>LED {led} 偏离 LED 文件中的位置 {distance:.2f} mm。这是该光笔的 LED 文件吗？</translation>
    </message>
    <message>
        <source>LEDs seen: {seen}, needed: {needed}. A finger may cover them; or lean back a little.</source>
        <translation>看到 {seen} 个 LED，需要 {needed} 个。可能被手指遮住；或稍微往回倾斜。</translation>
    </message>
    <message>
        <source>Next: accept the tip.</source>
        <translation>下一步：接受测头。</translation>
    </message>
    <message>
        <source>Next: capture more images; those of this swing are kept.</source>
        <translation>下一步：继续采集图像；本次摆动的图像会保留。</translation>
    </message>
    <message>
        <source>Next: check the intrinsics file and the LED file, then repeat.</source>
        <translation>下一步：检查内参文件和 LED 文件，然后重做。</translation>
    </message>
    <message>
        <source>Next: repeat the swing with the tip pressed in.</source>
        <translation>下一步：压紧测头，重做摆动。</translation>
    </message>
    <message>
        <source>Odd and even images put the tip {difference:.4f} mm apart, {usual:.4f} mm is usual. The tip may have moved: repeat the swing with the tip pressed in.</source>
        <translation>奇数与偶数图像求得的测头相差 {difference:.4f} mm，通常为 {usual:.4f} mm。测头可能移动过：请压紧测头，重做摆动。</translation>
    </message>
    <message>
        <source>Press the tip into the cone and keep it there.</source>
        <translation>把测头压入锥孔并保持。</translation>
    </message>
    <message>
        <source>Press the tip into the cone and swing the pen gently.</source>
        <translation>把测头压入锥孔，轻轻摆动光笔。</translation>
    </message>
    <message>
        <source>The LED file is off by {sigma:.3f} mm a coordinate, which alone makes U (k = 2) {uncertainty:.4f} mm. Is this the LED file of this pen? More images hardly help.</source>
        <translation>LED 文件每个坐标的误差约为 {sigma:.3f} mm，仅此就使 U (k = 2) 达到 {uncertainty:.4f} mm。这是该光笔的 LED 文件吗？增加图像作用不大。</translation>
    </message>
    <message>
        <source>The LEDs are smeared. Swing the pen slowly.</source>
        <translation>LED 有拖影。请慢慢摆动光笔。</translation>
    </message>
    <message>
        <source>The images do not tell yet where the tip is. Lean the pen to all sides.</source>
        <translation>目前的图像还不能确定测头位置。请向各个方向倾斜光笔。</translation>
    </message>
    <message>
        <source>The pen is lifted. Put the tip back to go on.</source>
        <translation>光笔已抬起。放回测头即可继续。</translation>
    </message>
    <message>
        <source>The residuals are {sigma:.2f} px, {usual:.2f} px or less is usual. Is this the LED file of this pen, and the intrinsics file of this camera and lens?</source>
        <translation>残差为 {sigma:.2f} px，通常不超过 {usual:.2f} px。LED 文件是否属于本光笔，内参文件是否属于这台相机和镜头？</translation>
    </message>
    <message>
        <source>The swing is paused.</source>
        <translation>摆动已暂停。</translation>
    </message>
    <message>
        <source>The tip is being computed. Put the pen down.</source>
        <translation>正在计算测头。可以放下光笔。</translation>
    </message>
    <message>
        <source>The tip rests in the cone. Keep it pressed in.</source>
        <translation>测头已在锥孔中。请保持压紧。</translation>
    </message>
    <message>
        <source>To YOUR right: it tells the program where you stand.</source>
        <translation>向“您的”右侧：程序由此得知您站在哪里。</translation>
    </message>
    <message>
        <source>Too little tilt {sides}. Lean the pen further that way. Images still needed: about {n_images}.</source>
        <translation>{sides}倾斜不足。请朝该方向再倾斜一些：约需 {n_images} 幅图像。</translation>
    </message>
    <message>
        <source>Turn its LEDs to the camera; nothing is lost meanwhile.</source>
        <translation>把 LED 转向相机；期间不会丢失任何数据。</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip is {uncertainty:.4f} mm, the limit {limit:.4f} mm. Capture more images in postures that differ.</source>
        <translation>测头的 U (k = 2) 为 {uncertainty:.4f} mm，限值 {limit:.4f} mm。请以不同姿态继续采集。</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip is {uncertainty:.4f} mm.</source>
        <translation>测头的 U (k = 2) 为 {uncertainty:.4f} mm。</translation>
    </message>
    <message>
        <source>away from the camera</source>
        <translation>远离相机方向</translation>
    </message>
    <message>
        <source>away to the left</source>
        <translation>远离相机偏左</translation>
    </message>
    <message>
        <source>away to the right</source>
        <translation>远离相机偏右</translation>
    </message>
    <message>
        <source>to most sides</source>
        <translation>向多数方向</translation>
    </message>
    <message>
        <source>to the left</source>
        <translation>向左</translation>
    </message>
    <message>
        <source>to the right</source>
        <translation>向右</translation>
    </message>
    <message>
        <source>towards the camera</source>
        <translation>朝向相机方向</translation>
    </message>
    <message>
        <source>towards the camera to the left</source>
        <translation>朝向相机偏左</translation>
    </message>
    <message>
        <source>towards the camera to the right</source>
        <translation>朝向相机偏右</translation>
    </message>
    <message>
        <source>{n_dropped} of {n_images} images do not take part. Repeat the swing if the tip slipped.</source>
        <translation>{n_images} 幅图像中有 {n_dropped} 幅未参与计算。若测头滑动过，请重做摆动。</translation>
    </message>
    <message>
        <source>{noise:.3f} px in this image, {usual:.3f} px in the others. A finger or a reflection may cover part of an LED.</source>
        <translation>本图像 {noise:.3f} px，其他图像 {usual:.3f} px。LED 可能被手指或反光遮住一部分。</translation>
    </message>
    <message>
        <source>{why}</source>
        <translation>{why}</translation>
    </message>
</context>
<context>
    <name>phrases</name>
    <message>
        <source>Show the pen</source>
        <translation>请出示光笔</translation>
    </message>
    <message>
        <source>Seat the tip</source>
        <translation>测头就位</translation>
    </message>
    <message>
        <source>Seat and swing</source>
        <translation>就位并摆动</translation>
    </message>
    <message>
        <source>Seated</source>
        <translation>已就位</translation>
    </message>
    <message>
        <source>{0} Review has their reasons.</source>
        <translation>{0}原因见“复核”步骤。</translation>
    </message>
    <message>
        <source>{0} Accept it at the screen.</source>
        <translation>{0}请在屏幕前接受。</translation>
    </message>
    <message>
        <source>Keep the tip pressed into the cone.</source>
        <translation>保持测头压紧在锥孔中。</translation>
    </message>
    <message>
        <source>Lean RIGHT</source>
        <translation>向右倾斜</translation>
    </message>
    <message>
        <source>Follow the arrow</source>
        <translation>跟随箭头</translation>
    </message>
    <message>
        <source>Show the LEDs</source>
        <translation>露出 LED</translation>
    </message>
    <message>
        <source>Slower</source>
        <translation>慢一点</translation>
    </message>
    <message>
        <source>LEDs do not fit</source>
        <translation>LED 不匹配</translation>
    </message>
    <message>
        <source>Tip slipped</source>
        <translation>测头滑动</translation>
    </message>
    <message>
        <source>Pen not seen</source>
        <translation>看不到光笔</translation>
    </message>
    <message>
        <source>Paused</source>
        <translation>已暂停</translation>
    </message>
    <message>
        <source>Tip not in place</source>
        <translation>测头不在原位</translation>
    </message>
    <message>
        <source>Press Space to go on.</source>
        <translation>按空格键继续。</translation>
    </message>
    <message>
        <source>Captured</source>
        <translation>采集完毕</translation>
    </message>
    <message>
        <source>Starts in {seconds}</source>
        <translation>{seconds} 秒后开始</translation>
    </message>
    <message>
        <source>More images</source>
        <translation>继续采集</translation>
    </message>
    <message>
        <source>Lean further</source>
        <translation>再倾斜一些</translation>
    </message>
    <message>
        <source>Hold it upright</source>
        <translation>竖直握住</translation>
    </message>
    <message>
        <source>Not known yet</source>
        <translation>尚未确定</translation>
    </message>
    <message>
        <source>Not certain enough</source>
        <translation>不确定度过大</translation>
    </message>
    <message>
        <source>Halves differ</source>
        <translation>奇偶结果不一致</translation>
    </message>
    <message>
        <source>Many images dropped</source>
        <translation>丢弃图像过多</translation>
    </message>
    <message>
        <source>LED out of place</source>
        <translation>LED 位置不符</translation>
    </message>
    <message>
        <source>No tip found</source>
        <translation>未求得测头</translation>
    </message>
    <message>
        <source>Good</source>
        <translation>良好</translation>
    </message>
    <message>
        <source>Enter the name of the station.</source>
        <translation>请填写工位名称。</translation>
    </message>
    <message>
        <source>Enter the name of the operator.</source>
        <translation>请填写操作员姓名。</translation>
    </message>
    <message>
        <source>Enter the serial number of the pen.</source>
        <translation>请填写光笔序列号。</translation>
    </message>
    <message>
        <source>Enter the name of the probe tip.</source>
        <translation>请填写测头名称。</translation>
    </message>
    <message>
        <source>Enter the name of the cone.</source>
        <translation>请填写锥孔名称。</translation>
    </message>
    <message>
        <source>Choose the folder of the recorded images.</source>
        <translation>请选择录制图像的文件夹。</translation>
    </message>
    <message>
        <source>No image has come from the camera yet.</source>
        <translation>相机还没有送来图像。</translation>
    </message>
    <message>
        <source>Open the intrinsics file.</source>
        <translation>请打开内参文件。</translation>
    </message>
    <message>
        <source>The intrinsics file is for images of another size.</source>
        <translation>内参文件适用于其他图像尺寸。</translation>
    </message>
    <message>
        <source>Open the LED geometry file.</source>
        <translation>请打开 LED 几何文件。</translation>
    </message>
    <message>
        <source>Save or discard the changes of the LED table.</source>
        <translation>请保存或放弃 LED 表的更改。</translation>
    </message>
    <message>
        <source>unreadable</source>
        <translation>无法读取</translation>
    </message>
    <message>
        <source>wrong size</source>
        <translation>尺寸不符</translation>
    </message>
    <message>
        <source>no LED seen</source>
        <translation>看不到 LED</translation>
    </message>
    <message>
        <source>blurred</source>
        <translation>图像模糊</translation>
    </message>
    <message>
        <source>too few LEDs</source>
        <translation>LED 太少</translation>
    </message>
    <message>
        <source>spots do not fit the pen</source>
        <translation>光点与光笔不匹配</translation>
    </message>
    <message>
        <source>ambiguous</source>
        <translation>有歧义</translation>
    </message>
    <message>
        <source>tip slipped</source>
        <translation>测头滑动</translation>
    </message>
    <message>
        <source>taken out</source>
        <translation>已剔除</translation>
    </message>
    <message>
        <source>WAITING</source>
        <translation>等待</translation>
    </message>
    <message>
        <source>PEN SEEN</source>
        <translation>看到光笔</translation>
    </message>
    <message>
        <source>SEATED</source>
        <translation>已就位</translation>
    </message>
    <message>
        <source>READY</source>
        <translation>准备</translation>
    </message>
    <message>
        <source>CAPTURING</source>
        <translation>采集中</translation>
    </message>
    <message>
        <source>PAUSED</source>
        <translation>已暂停</translation>
    </message>
    <message>
        <source>COMPUTING</source>
        <translation>计算中</translation>
    </message>
    <message>
        <source>NO TIP</source>
        <translation>无结果</translation>
    </message>
    <message>
        <source>PEN LOST</source>
        <translation>光笔丢失</translation>
    </message>
    <message>
        <source>LIFTED</source>
        <translation>已抬起</translation>
    </message>
    <message>
        <source>TIP MOVED</source>
        <translation>测头移位</translation>
    </message>
    <message>
        <source>PASS</source>
        <translation>合格</translation>
    </message>
    <message>
        <source>CHECK</source>
        <translation>待查</translation>
    </message>
    <message>
        <source>REPEAT</source>
        <translation>重做</translation>
    </message>
    <message>
        <source>Lean right</source>
        <translation>向右倾斜</translation>
    </message>
    <message>
        <source>Away, right</source>
        <translation>向右前倾斜</translation>
    </message>
    <message>
        <source>Lean away</source>
        <translation>向前倾斜</translation>
    </message>
    <message>
        <source>Away, left</source>
        <translation>向左前倾斜</translation>
    </message>
    <message>
        <source>Lean left</source>
        <translation>向左倾斜</translation>
    </message>
    <message>
        <source>To you, left</source>
        <translation>向左后倾斜</translation>
    </message>
    <message>
        <source>Lean to you</source>
        <translation>向后倾斜</translation>
    </message>
    <message>
        <source>To you, right</source>
        <translation>向右后倾斜</translation>
    </message>
    <message>
        <source>A little. Keep the tip pressed in.</source>
        <translation>稍微倾斜。保持测头压紧。</translation>
    </message>
    <message>
        <source>Far. Keep the tip pressed in.</source>
        <translation>多倾斜一些。保持测头压紧。</translation>
    </message>
    <message>
        <source>to the right</source>
        <translation>向右</translation>
    </message>
    <message>
        <source>away to the right</source>
        <translation>向右前</translation>
    </message>
    <message>
        <source>away from you</source>
        <translation>向前（远离您）</translation>
    </message>
    <message>
        <source>away to the left</source>
        <translation>向左前</translation>
    </message>
    <message>
        <source>to the left</source>
        <translation>向左</translation>
    </message>
    <message>
        <source>towards you to the left</source>
        <translation>向左后</translation>
    </message>
    <message>
        <source>towards you</source>
        <translation>向后（朝向您）</translation>
    </message>
    <message>
        <source>towards you to the right</source>
        <translation>向右后</translation>
    </message>
    <message>
        <source>Upright</source>
        <translation>竖直</translation>
    </message>
    <message>
        <source>Turn it counter-clockwise, seen from above.</source>
        <translation>从上方看，逆时针转动。</translation>
    </message>
    <message>
        <source>Turn it clockwise, seen from above.</source>
        <translation>从上方看，顺时针转动。</translation>
    </message>
    <message>
        <source>1 image</source>
        <translation>1 幅图像</translation>
    </message>
    <message>
        <source>{0} images</source>
        <translation>{0} 幅图像</translation>
    </message>
</context>
<context>
    <name>sounds</name>
    <message>
        <source>none of {0} is installed</source>
        <translation>未安装 {0} 中的任何一个</translation>
    </message>
</context>
</TS>
